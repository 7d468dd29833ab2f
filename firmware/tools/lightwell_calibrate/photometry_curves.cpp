#include "tools/lightwell_calibrate/photometry_curves.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <nlohmann/json.hpp>

#include "calibration/model/response.hpp"
#include "tools/lightwell_calibrate/json.hpp"

namespace lightwell::calibrate {
namespace {

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

}  // namespace

nlohmann::ordered_json curves_of(const PhotometryRun& run) {
  const LensParameters& lens = run.rig.lenses[static_cast<std::size_t>(run.lens)];
  return {{"response", response_of(run, lens.photometry)},
          {"vignetting", vignetting_of(run, lens)},
          {"noise", noise_of(run, lens.photometry)}};
}

}  // namespace lightwell::calibrate
