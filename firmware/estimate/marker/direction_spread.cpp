#include "estimate/marker/direction_spread.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/LU>

namespace lightwell::marker {
namespace {

/// Exponent 1 / kModelTemperature of the models' weights. Above 1: the residuals' independence is an approximation.
constexpr double kModelTemperature = 2;

/// Logarithmic map: the vector from unit vector `from` to `to` along the great circle, in tangent_basis(from), rad.
Eigen::Vector2d great_circle_offset(Vec3d from, Vec3d to) {
  const auto [u, v] = tangent_basis(from);
  const double angle = angle_between(from, to), x = dot(to, u), y = dot(to, v), across = std::hypot(x, y);
  if (!(across > 0)) return {angle, 0};
  return {x / across * angle, y / across * angle};
}

/// The direction in which another model has a light at `direction`: of its nearest light, or, if none is within
/// kMinSeparation_rad, of its strongest. Which of two lights is the stronger one says nothing about their directions.
Vec3d corresponding_direction(const LightModel& model, Vec3d direction) {
  const auto nearest = std::ranges::min_element(
      model.lights, {}, [&](const PointLight& light) { return angle_between(light.direction, direction); });
  if (angle_between(nearest->direction, direction) < kMinSeparation_rad) return nearest->direction;
  return model.lights[strongest(model)].direction;
}

/// Sums of weighted offsets from the reported direction.
class SpreadSums {
 public:
  /// The reported direction itself.
  SpreadSums(double weight, const Eigen::Matrix2d& covariance)
      : mass_(weight), main_mass_(weight), all_(weight * covariance), main_(weight * covariance) {}
  void add(double weight, const Eigen::Vector2d& offset) {
    const Eigen::Matrix2d square = weight * offset * offset.transpose();
    mass_ += weight, all_ += square;
    if (offset.norm() < kMinSeparation_rad) main_mass_ += weight, main_ += square;
  }
  [[nodiscard]] DirectionSpread spread() const { return {all_ / mass_, main_ / main_mass_, 1 - main_mass_ / mass_}; }

 private:
  double mass_, main_mass_;
  Eigen::Matrix2d all_, main_;
};

}  // namespace

DirectionSpread multimodal_spread(const Fit& best, std::size_t which, LightSearch& search,
                                  ObservationSet observation_set) {
  const Vec3d direction = best.model.lights[which].direction;
  const Eigen::Matrix2d own = best.covariance[which].topLeftCorner<2, 2>();

  std::vector<PointLight> fixed_lights = best.model.lights;
  fixed_lights.erase(fixed_lights.begin() + static_cast<std::ptrdiff_t>(which));
  const LightSearch::ChiSquareMap map = search.chi_square_map(observation_set, fixed_lights);
  // The grid search has no lower bounds on parameters, so that its minimum may be below that of the fit.
  double lowest = best.chi_square;
  for (const double chi : map.chi_square) lowest = std::min(lowest, chi);
  SpreadSums sums(2 * std::numbers::pi * std::sqrt(std::max(own.determinant(), 1e-18)), own);
  for (std::size_t i = 0; i < map.directions.size(); ++i) {
    const double weight = map.solid_angle * std::exp(-(map.chi_square[i] - lowest) / (2 * best.dispersion()));
    if (weight >= 1e-9) sums.add(weight, great_circle_offset(direction, map.directions[i]));
  }
  return sums.spread();
}

DirectionSpread model_spread(const FitCandidates& candidates, std::size_t which) {
  const Fit& best = candidates.best;
  const Vec3d direction = best.model.lights[which].direction;
  SpreadSums sums(1, Eigen::Matrix2d::Zero());
  for (const Fit& fit : candidates.others) {
    if (fit.model.lights.empty()) continue;
    const double weight = std::exp(-(fit.bic() - best.bic()) / (2 * kModelTemperature));
    if (weight < 1e-6) continue;
    sums.add(weight, great_circle_offset(direction, corresponding_direction(fit.model, direction)));
  }
  return sums.spread();
}

}  // namespace lightwell::marker
