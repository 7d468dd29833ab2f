// The error of an estimated direction against its covariance.
#pragma once

#include <array>
#include <cmath>

#include <lightwell/geometry.hpp>

namespace lightwell::measure {

struct DirectionError {
  double angle_rad = 0;
  double sigma_rad = 0;     ///< Standard deviation of the estimate along the error.
  double mahalanobis2 = 0;  ///< Squared Mahalanobis distance, two degrees of freedom.
};

/// `covariance`: of `estimate` in tangent_basis(estimate), rad²: u·u, u·v, v·v. Both directions are unit vectors. The
/// error is the tangent vector at `estimate` whose length is the angle.
[[nodiscard]] inline DirectionError direction_error(Vec3d estimate, const std::array<double, 3>& covariance,
                                                    Vec3d truth) {
  const auto [u, v] = tangent_basis(estimate);
  const double angle = angle_between(estimate, truth), across = std::hypot(dot(truth, u), dot(truth, v));
  const double x = across > 0 ? dot(truth, u) / across : 1, y = across > 0 ? dot(truth, v) / across : 0;
  const auto& [uu, uv, vv] = covariance;
  return {angle, std::sqrt(uu * x * x + 2 * uv * x * y + vv * y * y),
          angle * angle * (vv * x * x - 2 * uv * x * y + uu * y * y) / (uu * vv - uv * uv)};
}

}  // namespace lightwell::measure
