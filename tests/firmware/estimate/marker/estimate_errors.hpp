// Errors of an estimated light.
#pragma once

#include <cstddef>

#include <lightwell/geometry.hpp>

#include "estimate/marker/lighting_estimate.hpp"
#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker::test {

/// Angle between the direction of a light and the truth.
inline double error_deg(const LightingEstimate& light, Vec3d truth, std::size_t which = 0) {
  return angle_between(light.lights.at(which).light.direction, truth) / kDegree;
}

/// Squared Mahalanobis distance of a direction from the truth, two degrees of freedom.
inline double mahalanobis(const LightEstimate& estimate, Vec3d truth) {
  const auto [u, v] = tangent_basis(estimate.light.direction);
  const double angle = angle_between(estimate.light.direction, truth);
  const Vec3d across = normalized(truth - estimate.light.direction * dot(truth, estimate.light.direction)) * angle;
  const double x = dot(across, u), y = dot(across, v);
  const auto& c = estimate.direction_covariance;
  return (c[2] * x * x - 2 * c[1] * x * y + c[0] * y * y) / (c[0] * c[2] - c[1] * c[1]);
}

}  // namespace lightwell::marker::test
