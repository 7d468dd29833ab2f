#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <iostream>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "calibration/model/response.hpp"
#include "tools/command_line.hpp"
#include "tools/lightwell_calibrate/commands.hpp"
#include "tools/lightwell_calibrate/photometry_steps.hpp"

namespace lightwell::calibrate {
namespace {

constexpr const char* kFooter = R"(Examples:
  lightwell-calibrate photometry --calibration rig.textproto --dark dark --response series --output rig.textproto
  lightwell-calibrate photometry --calibration rig.textproto --flat flats --lamp turned --output rig.textproto \
      --json | lightwell_plot.py --output curves.png                        draws curves and data
  lightwell-calibrate photometry --calibration rig.textproto --grey card/a.png:300,200,80,60 --lux 540 --albedo 0.18 \
      --output rig.textproto

A folder lists its pictures in frames.csv (file,exposure_s,time_s; also gain, lens, bracket_index, bracket_size):
  dark      lens covered, all with the same gain; two pictures or more
  response  a static scene, exposures from nearly dark to nearly white, each about twice the one before
  flat      an evenly lit wall or a diffuser, three exposures or more, two successive pictures of each
  lamp      one small constant lamp in a dark room; rotate the camera so that it moves from the centre to the edge;
            angles.csv (file,angle_deg) has the angles from the axis, otherwise the lens's geometry gives them
PNG and JPEG have 8 bits. OpenEXR has picture values relative to full scale (from converted raw files).
No automatic exposure, no noise reduction; JPEG changes the noise: take flats and darks as PNG or OpenEXR.
White is the light on the grey card: D65, or that of --grey-xy. The factors are relative to green.
Steps without input keep the values of the calibration.
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.)";

constexpr double kDegree = std::numbers::pi / 180;

nlohmann::ordered_json point(double x, double y, double deviation, bool counted) {
  return {json_number(x), json_number(y), json_number(deviation), counted};
}

/// 101 points from 0 to x_end; `numbers_at` returns the numbers of one.
template <class NumbersAt>
nlohmann::ordered_json curve(double x_end, const NumbersAt& numbers_at) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (int i = 0; i <= 100; ++i) out.push_back(json_numbers(numbers_at(x_end * i / 100)));
  return out;
}

nlohmann::ordered_json response_of(const PhotometryRun& run, const PhotometricCalibration& p) {
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  if (run.response) {
    // Only some of the inliers, so that the curve stays visible; all outliers.
    const auto& all = run.response->points;
    const std::size_t step = std::max<std::size_t>(1, all.size() / 150);
    for (std::size_t k = 0; k < all.size(); ++k)
      if (!all[k].counted || k % step == 0) points.push_back(point(all[k].linear, all[k].value, 0, all[k].counted));
  }
  const auto numbers_at = [&](double x) {
    return std::array{x, encoded(p.response, p.black_level + (1 - p.black_level) * x)};
  };
  return {{"curve", curve(1, numbers_at)}, {"points", std::move(points)}};
}

nlohmann::ordered_json vignetting_of(const PhotometryRun& run, const LensParameters& lens) {
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  if (run.vignetting) {
    const photometry::VignettingEstimate& v = *run.vignetting;
    for (std::size_t k = 0; k < run.observations.size(); ++k) {
      const photometry::LampObservation& o = run.observations[k];
      points.push_back(point(o.angle_rad / kDegree, o.value / v.level, o.deviation / v.level, v.weight[k] > 0));
    }
  }
  const auto numbers_at = [&](double degrees) {
    const double angle = degrees * kDegree;
    return std::array{degrees, vignetting(lens.photometry, angle),
                      run.vignetting ? vignetting_deviation(*run.vignetting, angle) : 0};
  };
  return {{"curve", curve(lens.max_angle_rad / kDegree, numbers_at)}, {"points", std::move(points)}};
}

nlohmann::ordered_json noise_of(const PhotometryRun& run, const PhotometricCalibration& p) {
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  double x_end = run.levels.empty() ? 1 : 0;
  for (const photometry::NoiseLevel& l : run.levels) {
    const double gain2 = l.gain * l.gain;
    x_end = std::max(x_end, 1.08 * l.mean / l.gain);
    if (run.noise)
      points.push_back(
          point(l.mean / l.gain, l.variance / gain2, (l.variance + l.rounding) * std::sqrt(2 / l.count) / gain2, true));
  }
  if (run.noise && run.dark && run.dark->resolved) {
    const photometry::DarkEstimate& d = *run.dark;
    points.push_back(point(0, d.read_noise * d.read_noise, 2 * d.read_noise * d.read_deviation, true));
  }
  const auto numbers_at = [&](double x) { return std::array{x, p.read_noise * p.read_noise + p.shot_noise * x}; };
  return {{"curve", curve(x_end, numbers_at)}, {"points", std::move(points)}};
}

/// The curves of the calibration and the measurements that they were fitted to, for a drawing. Each has "curve", a list
/// of [x, y] of the calibration, and "points", a list of [x, y, standard deviation of y, whether it counted], which is
/// empty for a step without input.
///   response    linear light and picture value, shares of full scale; all outliers, at most 300 others, deviation 0
///   vignetting  degrees from the axis, illumination relative to that on the axis; its curve has the standard deviation
///               of y as a third number, 0 without input
///   noise       linear light x divided by the gain, variance of x at gain 1
nlohmann::ordered_json curves_of(const PhotometryRun& run) {
  const LensParameters& lens = run.rig.lenses[static_cast<std::size_t>(run.lens)];
  return {{"response", response_of(run, lens.photometry)},
          {"vignetting", vignetting_of(run, lens)},
          {"noise", noise_of(run, lens.photometry)}};
}

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

/// A step without input is null. Deviations are in the unit of their value. "calibration": the resulting calibration.
nlohmann::ordered_json json_of(const PhotometryRun& run) {
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
  return out;
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

/// Parses IMAGE:x,y,w,h.
bool split_grey(const std::string& text, PhotometryInputs& inputs) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return false;
  const auto r = parse_numbers<int, 4>(std::string_view(text).substr(colon + 1));
  if (!r) return false;
  inputs.grey = text.substr(0, colon);
  inputs.patch = {(*r)[0], (*r)[1], (*r)[2], (*r)[3]};
  return true;
}

}  // namespace

int photometry_command(const std::vector<std::string>& arguments) {
  CLI::App app{"Calibrates the photometry of a camera: response, black level, noise, vignetting, white balance, scale.",
               "lightwell-calibrate photometry"};
  app.footer(kFooter);
  PhotometryInputs in;
  std::string calibration, output, grey, grey_xy;
  bool json = false;
  app.add_option("--calibration", calibration, "The present rig: geometry, and photometry to start from")->required();
  app.add_option("--output", output, "The rig with the measured photometry; replaced atomically")->required();
  app.add_option("--lens", in.lens, "Lens of the rig that took the pictures [0]");
  app.add_option("--dark", in.dark, "Folder: black level and read noise");
  app.add_option("--response", in.response, "Folder: response curve");
  app.add_option("--flat", in.flat, "Folder: read and shot noise");
  app.add_option("--lamp", in.lamp, "Folder: vignetting");
  app.add_option("--grey", grey, "IMAGE:x,y,w,h, a patch of a grey card: white balance, and the target of the meter");
  auto* xy = app.add_option("--grey-xy", grey_xy, "x,y: CIE 1931 chromaticity of the light on the card [D65]");
  auto* seconds =
      app.add_option("--grey-exposure-s", in.grey_exposure_s, "Exposure of that picture [frames.csv beside it]");
  auto* gain = app.add_option("--grey-gain", in.grey_gain, "Gain of that picture [1]");
  auto* nits = app.add_option("--nits", in.nits, "Luminance meter's reading of the patch, cd/m2");
  auto* lux = app.add_option("--lux", in.lux, "Lux meter's reading on the card");
  auto* albedo = app.add_option("--albedo", in.albedo, "The card's albedo (reflectance), with --lux");
  app.add_option("--meter-deviation", in.meter_deviation, "Relative standard deviation of the meter [0.04]");
  app.add_option("--bits", in.bits, "Bit depth of the values in OpenEXR, 8 to 16 [not quantised]");
  app.add_flag("--json", json, "Print the result as JSON on standard output; lightwell_plot.py draws it");
  return run_command(app, arguments, [&] {
    if (!grey.empty() && !split_grey(grey, in)) throw UsageError("--grey '" + grey + "' is not IMAGE:x,y,w,h");
    if (in.grey.empty() && (in.nits || in.lux || *xy || *seconds || *gain))
      throw UsageError("--nits, --lux and --grey-... need a patch; give it with --grey");
    if (*xy && !(in.grey_xy = parse_numbers<double, 2>(grey_xy)))
      throw UsageError("--grey-xy '" + grey_xy + "' is not x,y");
    if ((*nits && !in.nits) || (*lux && !in.lux)) throw UsageError("--nits and --lux need a number");
    if (in.nits && in.lux) throw UsageError("give either --nits or --lux");
    if (in.lux.has_value() != bool(*albedo)) throw UsageError("--lux and --albedo go together");
    if (in.bits != 0 && (in.bits < 8 || in.bits > 16)) throw UsageError("--bits must be 8 to 16");
    if (in.dark.empty() && in.response.empty() && in.flat.empty() && in.lamp.empty() && in.grey.empty())
      throw UsageError("nothing to measure: give --dark, --response, --flat, --lamp or --grey");

    PhotometryRun run = calibrate_photometry(require(load_calibration(calibration)), in);
    if (!run.rig.report) run.rig.report.emplace();
    run.rig.report->photometry_time_s = std::time(nullptr);
    require(write_output(output, calibration_to_text(run.rig)));
    for (const std::string& note : run.notes) std::cerr << app.get_name() << ": " << note << "\n";
    std::cout << (json ? json_text(json_of(run)) + "\n" : to_text(run)) << std::flush;
    return kDone;
  });
}

}  // namespace lightwell::calibrate
