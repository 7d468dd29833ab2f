// Covariance of a direction due to an uncertain rotation.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include <lightwell/geometry.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

/// Covariance (rad²; u·u, u·v, v·v in tangent_basis(direction)) of a unit direction whose frame is rotated by the error
/// of `pose`, to first order: a small rotation vector w displaces d by w x d, which is w·v along u and -w·u along v. A
/// rotation about the direction itself has no effect and may be unknown; if any other component is unknown, u·u and v·v
/// are infinite.
[[nodiscard]] inline std::array<double, 3> direction_covariance(Vec3d direction, const PoseCovariance& pose) {
  const auto [u, v] = tangent_basis(direction);
  const std::array<double, 3> along_u{v.x, v.y, v.z}, along_v{-u.x, -u.y, -u.z};
  const auto moment = [&](const std::array<double, 3>& a, const std::array<double, 3>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const double weight = a[i] * b[k];
        if (std::abs(weight) > 1e-12) sum += weight * pose[i][k];
      }
    return sum;
  };
  const double uu = moment(along_u, along_u), uv = moment(along_u, along_v), vv = moment(along_v, along_v);
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  if (!std::isfinite(uu + uv + vv)) return {kUnknown, 0, kUnknown};
  return {uu, uv, vv};
}

}  // namespace lightwell
