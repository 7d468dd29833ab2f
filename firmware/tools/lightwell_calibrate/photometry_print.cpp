#include "tools/lightwell_calibrate/photometry_print.hpp"

#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "tools/lightwell_calibrate/json.hpp"

namespace lightwell::calibrate {
namespace {

[[gnu::format(printf, 1, 2)]] std::string text(const char* format, ...) {
  std::array<char, 512> out{};
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(out.data(), out.size(), format, arguments);
  va_end(arguments);
  return out.data();
}

std::string json_of(const photometry::ResponseEstimate& r) {
  std::string scores;
  for (const photometry::ResponseScore& s : r.scores)
    scores += text("%s{\"kind\": \"%s\", \"criterion\": %s, \"from_table\": %s}", scores.empty() ? "" : ", ",
                   std::string(photometry::to_string(s.kind)).c_str(), json_number(s.criterion).c_str(),
                   json_number(s.from_table).c_str());
  return text("{\"kind\": \"%s\", \"gamma\": %s, \"gamma_deviation\": %s, ",
              std::string(photometry::to_string(r.response.kind)).c_str(), json_number(r.response.gamma).c_str(),
              json_number(r.gamma_deviation).c_str()) +
         text("\"residual\": %s, \"samples\": %d, \"outliers\": %d, ", json_number(r.residual).c_str(), r.samples,
              r.outliers) +
         "\"scores\": [" + scores + "]}";
}

std::string json_of(const photometry::DarkEstimate& d) {
  return text("{\"black_level\": %s, \"black_deviation\": %s, ", json_number(d.black_level).c_str(),
              json_number(d.black_deviation).c_str()) +
         text("\"read_noise\": %s, \"read_deviation\": %s, ", json_number(d.read_noise).c_str(),
              json_number(d.read_deviation).c_str()) +
         text("\"clipped\": %s, \"resolved\": %s, \"outlier_share\": %s}", d.clipped ? "true" : "false",
              d.resolved ? "true" : "false", json_number(d.outlier_share).c_str());
}

std::string json_of(const photometry::NoiseEstimate& n, std::size_t levels) {
  return text("{\"read_noise\": %s, \"read_deviation\": %s, ", json_number(n.read_noise).c_str(),
              json_number(n.read_deviation).c_str()) +
         text("\"shot_noise\": %s, \"shot_deviation\": %s, ", json_number(n.shot_noise).c_str(),
              json_number(n.shot_deviation).c_str()) +
         text("\"levels\": %zu, \"scatter\": %s}", levels, json_number(n.scatter).c_str());
}

std::string json_of(const photometry::VignettingEstimate& v) {
  return "{\"vignetting\": " + json_numbers(v.vignetting) + ", \"covariance\": " + json_numbers(v.covariance) +
         text(", \"residual\": %s, \"sightings\": %zu, \"outliers\": %d}", json_number(v.residual).c_str(),
              v.weight.size(), v.outliers);
}

}  // namespace

std::string json_of(const PhotometryRun& run) {
  std::string notes;
  for (const std::string& n : run.notes) notes += (notes.empty() ? "" : ", ") + json_string(n);
  const auto or_null = [](bool there, const auto& make) { return there ? make() : std::string("null"); };
  return text("{\"lens\": %d, \"response\": ", run.lens) +
         or_null(run.response.has_value(), [&] { return json_of(*run.response); }) +
         ", \"dark\": " + or_null(run.dark.has_value(), [&] { return json_of(*run.dark); }) +
         ", \"noise\": " + or_null(run.noise.has_value(), [&] { return json_of(*run.noise, run.levels.size()); }) +
         ", \"vignetting\": " + or_null(run.vignetting.has_value(), [&] { return json_of(*run.vignetting); }) +
         ", \"white_balance\": " +
         or_null(run.white_balance.has_value(),
                 [&] {
                   return "{\"factors\": " + json_numbers(run.white_balance->factors) +
                          ", \"covariance\": " + json_numbers(run.white_balance->covariance) + "}";
                 }) +
         ", \"scale\": " +
         or_null(run.scale.has_value(),
                 [&] {
                   return text("{\"nits_per_unit\": %s, \"deviation\": %s}",
                               json_number(run.scale->nits_per_unit).c_str(),
                               json_number(run.scale->deviation).c_str());
                 }) +
         ", \"notes\": [" + notes + "]}\n";
}

std::string to_text(const PhotometryRun& run) {
  std::string out;
  if (run.response) {
    out += "response      " + std::string(photometry::to_string(run.response->response.kind));
    if (run.response->response.kind == ResponseCurve::Kind::gamma)
      out += text(" %.4f +- %.4f", run.response->response.gamma, run.response->gamma_deviation);
    out += text("; %d samples, %d outliers, typical residual %.2f %% of full scale\n", run.response->samples,
                run.response->outliers, 100 * run.response->residual);
  }
  if (run.dark)
    out += text("black level   %.6f +- %.6f%s\n", run.dark->black_level, run.dark->black_deviation,
                run.dark->clipped ? "; part of the noise is below the lowest code" : "");
  if (run.dark && run.dark->resolved && !run.noise)
    out += text("read noise    %.4g +- %.2g\n", run.dark->read_noise, run.dark->read_deviation);
  if (run.noise)
    out += text("read noise    %.4g +- %.2g\nshot noise    %.4g +- %.2g; %zu levels\n", run.noise->read_noise,
                run.noise->read_deviation, run.noise->shot_noise, run.noise->shot_deviation, run.levels.size());
  if (run.vignetting) {
    const auto& v = *run.vignetting;
    out += text("vignetting    %.5f %.5f %.5f; %zu observations, %d outliers, typical residual %.2f %%\n",
                v.vignetting[0], v.vignetting[1], v.vignetting[2], v.weight.size(), v.outliers, 100 * v.residual);
  }
  if (run.white_balance)
    out +=
        text("white balance %.4f 1 %.4f +- %.4f, %.4f\n", run.white_balance->factors[0], run.white_balance->factors[2],
             std::sqrt(run.white_balance->covariance[0]), std::sqrt(run.white_balance->covariance[3]));
  if (run.scale)
    out += text("scale         %.5g +- %.2g cd/m2 per unit\n", run.scale->nits_per_unit, run.scale->deviation);
  return out;
}

}  // namespace lightwell::calibrate
