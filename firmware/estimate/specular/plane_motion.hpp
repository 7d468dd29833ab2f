// Small motions of a plane in its own frame, for .cpp files: x -> x + rotation × x + translation, as the six numbers
// (rotation in rad, translation in m).
#pragma once

#include <cmath>
#include <cstddef>

#include <Eigen/Dense>

#include <lightwell/uncertain_pose.hpp>

namespace lightwell::specular {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// As a pose. Rotation and translation are separate, as in UncertainPose: this is SO(3) x R³, not the exponential map
/// of SE(3).
[[nodiscard]] inline Pose exponential(const Vector6& m) {
  const Vec3d w{m[0], m[1], m[2]};
  return {Quat::about(normalized(w), length(w)), {m[3], m[4], m[5]}};
}

/// The inverse of exponential().
[[nodiscard]] inline Vector6 logarithm(const Pose& pose) {
  Quat q = pose.rotation.normalized();
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  const double sine = length(Vec3d{q.x, q.y, q.z}), scale = sine > 1e-12 ? 2 * std::atan2(sine, q.w) / sine : 2;
  Vector6 out;
  out << scale * q.x, scale * q.y, scale * q.z, pose.translation.x, pose.translation.y, pose.translation.z;
  return out;
}

/// Covariance of a pose error as a motion in the plane's frame: that of the pose T_probe_plane, turned from the axes of
/// the probe to those of the plane. Unknown components get 1 rad² or m².
[[nodiscard]] inline Matrix6 motion_covariance(const UncertainPose& prior) {
  // Composed with an exact inverse, the error is that of T_plane_plane.
  const PoseCovariance in_plane = compose(UncertainPose{inverse(prior.pose), {}}, prior).covariance;
  Matrix6 out;
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) {
      const double v = in_plane[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
      out(r, c) = std::isfinite(v) ? v : 1;
    }
  // 0.01 degrees and 0.01 mm: no tag is known better, and a covariance of zero has no inverse.
  for (int k = 0; k < 3; ++k) out(k, k) += 3e-8, out(k + 3, k + 3) += 1e-10;
  return out;
}

}  // namespace lightwell::specular
