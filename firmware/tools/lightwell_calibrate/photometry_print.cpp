#include "tools/lightwell_calibrate/photometry_print.hpp"

#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "tools/json_text.hpp"
#include "tools/lightwell_calibrate/json.hpp"
#include "tools/lightwell_calibrate/photometry_curves.hpp"

namespace lightwell::calibrate {
namespace {

nlohmann::ordered_json json_of(const photometry::ResponseEstimate& r) {
  nlohmann::ordered_json scores = nlohmann::ordered_json::array();
  for (const photometry::ResponseScore& s : r.scores)
    scores.push_back({{"kind", photometry::to_string(s.kind)},
                      {"criterion", json_number(s.criterion)},
                      {"from_table", json_number(s.from_table)}});
  return {{"kind", photometry::to_string(r.response.kind)},
          {"gamma", json_number(r.response.gamma)},
          {"gamma_deviation", json_number(r.gamma_deviation)},
          {"residual", json_number(r.residual)},
          {"samples", r.samples},
          {"outliers", r.outliers},
          {"scores", std::move(scores)}};
}

nlohmann::ordered_json json_of(const photometry::DarkEstimate& d) {
  return {{"black_level", json_number(d.black_level)},
          {"black_deviation", json_number(d.black_deviation)},
          {"read_noise", json_number(d.read_noise)},
          {"read_deviation", json_number(d.read_deviation)},
          {"clipped", d.clipped},
          {"resolved", d.resolved},
          {"outlier_share", json_number(d.outlier_share)}};
}

nlohmann::ordered_json json_of(const photometry::NoiseEstimate& n, std::size_t levels) {
  return {{"read_noise", json_number(n.read_noise)},
          {"read_deviation", json_number(n.read_deviation)},
          {"shot_noise", json_number(n.shot_noise)},
          {"shot_deviation", json_number(n.shot_deviation)},
          {"levels", levels},
          {"scatter", json_number(n.scatter)}};
}

nlohmann::ordered_json json_of(const photometry::VignettingEstimate& v) {
  return {{"vignetting", json_numbers(v.vignetting)},
          {"covariance", json_numbers(v.covariance)},
          {"residual", json_number(v.residual)},
          {"sightings", v.weight.size()},
          {"outliers", v.outliers}};
}

}  // namespace

std::string json_of(const PhotometryRun& run) {
  nlohmann::ordered_json out = {{"lens", run.lens}, {"response", nullptr},   {"dark", nullptr},
                                {"noise", nullptr}, {"vignetting", nullptr}, {"white_balance", nullptr},
                                {"scale", nullptr}, {"notes", run.notes}};
  if (run.response) out["response"] = json_of(*run.response);
  if (run.dark) out["dark"] = json_of(*run.dark);
  if (run.noise) out["noise"] = json_of(*run.noise, run.levels.size());
  if (run.vignetting) out["vignetting"] = json_of(*run.vignetting);
  if (run.white_balance)
    out["white_balance"] = {{"factors", json_numbers(run.white_balance->factors)},
                            {"covariance", json_numbers(run.white_balance->covariance)}};
  if (run.scale)
    out["scale"] = {{"nits_per_unit", json_number(run.scale->nits_per_unit)},
                    {"deviation", json_number(run.scale->deviation)}};
  const PhotometricCalibration& p = run.rig.lenses[static_cast<std::size_t>(run.lens)].photometry;
  out["calibration"] = {{"black_level", json_number(p.black_level)},
                        {"white_balance", json_numbers(p.white_balance)},
                        {"nits_per_unit", json_number(run.rig.nits_per_unit)}};
  out["curves"] = curves_of(run);
  return json_text(out) + "\n";
}

std::string to_text(const PhotometryRun& run) {
  std::string out;
  if (run.response) {
    out += "response      " + std::string(photometry::to_string(run.response->response.kind));
    if (run.response->response.kind == ResponseCurve::Kind::gamma)
      out += formatted(" %.4f +- %.4f", run.response->response.gamma, run.response->gamma_deviation);
    out += formatted("; %d samples, %d outliers, typical residual %.2f %% of full scale\n", run.response->samples,
                     run.response->outliers, 100 * run.response->residual);
  }
  if (run.dark)
    out += formatted("black level   %.6f +- %.6f%s\n", run.dark->black_level, run.dark->black_deviation,
                     run.dark->clipped ? "; part of the noise is below the lowest code" : "");
  if (run.dark && run.dark->resolved && !run.noise)
    out += formatted("read noise    %.4g +- %.2g\n", run.dark->read_noise, run.dark->read_deviation);
  if (run.noise)
    out += formatted("read noise    %.4g +- %.2g\nshot noise    %.4g +- %.2g; %zu levels\n", run.noise->read_noise,
                     run.noise->read_deviation, run.noise->shot_noise, run.noise->shot_deviation, run.levels.size());
  if (run.vignetting) {
    const auto& v = *run.vignetting;
    out += formatted("vignetting    %.5f %.5f %.5f; %zu observations, %d outliers, typical residual %.2f %%\n",
                     v.vignetting[0], v.vignetting[1], v.vignetting[2], v.weight.size(), v.outliers, 100 * v.residual);
  }
  if (run.white_balance)
    out += formatted("white balance %.4f 1 %.4f +- %.4f, %.4f\n", run.white_balance->factors[0],
                     run.white_balance->factors[2], std::sqrt(run.white_balance->covariance[0]),
                     std::sqrt(run.white_balance->covariance[3]));
  if (run.scale)
    out += formatted("scale         %.5g +- %.2g cd/m2 per unit\n", run.scale->nits_per_unit, run.scale->deviation);
  return out;
}

}  // namespace lightwell::calibrate
