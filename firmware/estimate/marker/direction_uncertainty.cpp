#include "estimate/marker/direction_uncertainty.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/LU>

namespace lightwell::marker {
namespace {

/// Radii of the discs that are tried in place of a point light, and the increase of chi square up to which a disc
/// explains the faces as well.
constexpr std::array kSourceRadii_rad = {0.2, 0.4, 0.7, 1.0};
constexpr double kMaxChiSquareIncrease = 16;
/// Standard deviation of a direction where point lights do not explain the observations.
constexpr double kModelMisfit_rad = 0.2;

/// Logarithmic map: the vector from unit vector `from` to `to` along the great circle, in tangent_basis(from), rad.
Eigen::Vector2d great_circle_offset(Vec3d from, Vec3d to) {
  const auto [u, v] = tangent_basis(from);
  const double angle = angle_between(from, to), x = dot(to, u), y = dot(to, v), across = std::hypot(x, y);
  if (!(across > 0)) return {angle, 0};
  return {x / across * angle, y / across * angle};
}

std::size_t strongest(const LightModel& model) {
  std::size_t out = 0;
  for (std::size_t k = 1; k < model.lights.size(); ++k)
    if (luminance(model.lights[k].irradiance) > luminance(model.lights[out].irradiance)) out = k;
  return out;
}

}  // namespace

Eigen::Matrix2d multimodal_covariance(const Fit& best, std::size_t which, LightSearch& search,
                                      ObservationSet observation_set) {
  const Vec3d direction = best.model.lights[which].direction;
  const Eigen::Matrix2d own = best.covariance[which].topLeftCorner<2, 2>();

  std::vector<PointLight> fixed_lights = best.model.lights;
  fixed_lights.erase(fixed_lights.begin() + static_cast<std::ptrdiff_t>(which));
  const LightSearch::ChiSquareMap map = search.chi_square_map(observation_set, fixed_lights);
  // The grid search has no lower bounds on parameters, so that its minimum may be below that of the fit.
  double lowest = best.chi_square;
  for (const double chi : map.chi_square) lowest = std::min(lowest, chi);
  double mass = 2 * std::numbers::pi * std::sqrt(std::max(own.determinant(), 1e-18));
  Eigen::Matrix2d spread = mass * own;
  for (std::size_t i = 0; i < map.directions.size(); ++i) {
    const double weight = map.solid_angle * std::exp(-(map.chi_square[i] - lowest) / 2);
    if (weight < 1e-9) continue;
    const Eigen::Vector2d offset = great_circle_offset(direction, map.directions[i]);
    spread += weight * offset * offset.transpose();
    mass += weight;
  }
  return spread / mass;
}

Eigen::Matrix2d model_averaged_covariance(const FitCandidates& candidates, std::size_t which) {
  const Fit& best = candidates.best;
  const Vec3d direction = best.model.lights[which].direction;
  double models = 1;
  Eigen::Matrix2d out = Eigen::Matrix2d::Zero();
  for (const Fit& fit : candidates.others) {
    if (fit.model.lights.empty()) continue;
    const double weight = std::exp(-(fit.bic() - best.bic()) / 2);
    if (weight < 1e-6) continue;
    // The corresponding light of the other model: its strongest for the strongest light, else the nearest.
    std::size_t same = strongest(fit.model);
    if (which != strongest(best.model))
      for (std::size_t k = 0; k < fit.model.lights.size(); ++k)
        if (angle_between(direction, fit.model.lights[k].direction) <
            angle_between(direction, fit.model.lights[same].direction))
          same = k;
    const Eigen::Vector2d offset = great_circle_offset(direction, fit.model.lights[same].direction);
    out += weight * offset * offset.transpose();
    models += weight;
  }
  return out / models;
}

Eigen::Matrix2d transport_covariance(const Eigen::Matrix2d& covariance, Vec3d from, Vec3d to) {
  const auto [u, v] = tangent_basis(from);
  const auto [s, t] = tangent_basis(to);
  Eigen::Matrix2d rotation;
  rotation << dot(s, u), dot(s, v), dot(t, u), dot(t, v);
  return rotation * covariance * rotation.transpose();
}

double source_size_variance(const Fit& best, std::size_t which, const LightSearch& search) {
  std::vector<PointLight> fixed_lights = best.model.lights;
  fixed_lights.erase(fixed_lights.begin() + static_cast<std::ptrdiff_t>(which));
  const PointLight& light = best.model.lights[which];
  const double as_point = search.chi_square_of(light, 0, fixed_lights);
  double widest = 0;
  for (const double radius : kSourceRadii_rad)
    if (search.chi_square_of(light, radius, fixed_lights) < as_point + kMaxChiSquareIncrease) widest = radius;
  return widest * widest / 4;
}

double model_misfit_variance(const LightModel& model) {
  for (std::size_t c = 0; c < 3; ++c) {
    const double slope = std::hypot(model.ambient[1][c], model.ambient[2][c], model.ambient[3][c]);
    if (slope > model.ambient[0][c]) return kModelMisfit_rad * kModelMisfit_rad;
  }
  return 0;
}

}  // namespace lightwell::marker
