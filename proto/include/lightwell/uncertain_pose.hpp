// Poses with covariance, and first-order propagation of the covariance through composition and inversion, and to
// directions.
//
// The error of T_a_b is (rotation, translation), six numbers in the axes of a: p_a = Exp(rotation) R p_b + t +
// translation. The rotation (rad) is about the origin of b, so that it does not move that origin; the translation
// (m) does. An unknown component has infinite variance and zero covariance with the others.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <lightwell/geometry.hpp>

namespace lightwell {

/// Row by row: rotation x, y, z (rad), translation x, y, z (m).
using PoseCovariance = std::array<std::array<double, 6>, 6>;

struct UncertainPose {
  Pose pose;
  PoseCovariance covariance{};

  friend constexpr bool operator==(const UncertainPose&, const UncertainPose&) = default;
};

namespace pose_detail {

using Matrix3 = std::array<std::array<double, 3>, 3>;

[[nodiscard]] constexpr Matrix3 matrix_of(Quat q) {
  const Vec3d x = rotate(q, Vec3d{1, 0, 0}), y = rotate(q, Vec3d{0, 1, 0}), z = rotate(q, Vec3d{0, 0, 1});
  return {{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}};
}

/// [v]x: the cross product of v with a vector.
[[nodiscard]] constexpr Matrix3 cross_matrix(Vec3d v) { return {{{0, -v.z, v.y}, {v.z, 0, -v.x}, {-v.y, v.x, 0}}}; }

/// Adds J C J' to `out`, with the Jacobian J of 3x3 blocks (rotation, 0; lever, translation). A component that depends
/// on one of infinite variance gets infinite variance and zero covariances.
inline void add_propagated_covariance(const Matrix3& rotation, const Matrix3& lever, const Matrix3& translation,
                                      const PoseCovariance& c, PoseCovariance& out) {
  PoseCovariance j{}, finite = c;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t k = 0; k < 3; ++k) {
      j[r][k] = rotation[r][k];
      j[r + 3][k] = lever[r][k];
      j[r + 3][k + 3] = translation[r][k];
    }
  std::array<bool, 6> unknown{};
  for (std::size_t k = 0; k < 6; ++k) {
    if (std::isfinite(c[k][k])) continue;
    for (std::size_t r = 0; r < 6; ++r) {
      // The threshold keeps the rounding error of a rotation from counting as a nonzero coefficient.
      unknown[r] = unknown[r] || std::abs(j[r][k]) > 1e-12;
      finite[r][k] = finite[k][r] = 0;
    }
  }
  PoseCovariance half{};
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t k = 0; k < 6; ++k)
      for (std::size_t i = 0; i < 6; ++i) half[r][k] += j[r][i] * finite[i][k];
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t k = 0; k < 6; ++k)
      for (std::size_t i = 0; i < 6; ++i) out[r][k] += half[r][i] * j[k][i];
  for (std::size_t r = 0; r < 6; ++r) {
    if (!unknown[r] && std::isfinite(out[r][r])) continue;
    for (std::size_t k = 0; k < 6; ++k) out[r][k] = out[k][r] = 0;
    out[r][r] = std::numeric_limits<double>::infinity();
  }
}

inline constexpr Matrix3 kZero{};
inline constexpr Matrix3 kIdentity{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

}  // namespace pose_detail

/// T_a_c = T_a_b T_b_c. The errors of the two poses are taken as independent.
[[nodiscard]] inline UncertainPose compose(const UncertainPose& a_b, const UncertainPose& b_c) {
  using namespace pose_detail;
  UncertainPose out{compose(a_b.pose, b_c.pose), {}};
  const Matrix3 r = matrix_of(a_b.pose.rotation);
  // A rotation error w of b moves the origin of c by w x (R t).
  const Matrix3 lever = cross_matrix(-rotate(a_b.pose.rotation, b_c.pose.translation));
  add_propagated_covariance(kIdentity, lever, kIdentity, a_b.covariance, out.covariance);
  add_propagated_covariance(r, kZero, r, b_c.covariance, out.covariance);
  return out;
}

/// T_b_a.
[[nodiscard]] inline UncertainPose inverse(const UncertainPose& a_b) {
  using namespace pose_detail;
  UncertainPose out{inverse(a_b.pose), {}};
  const Matrix3 r = matrix_of(a_b.pose.rotation);
  Matrix3 minus_r_transposed{}, lever{};
  const Matrix3 t_cross = cross_matrix(a_b.pose.translation);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      minus_r_transposed[i][k] = -r[k][i];
      for (std::size_t n = 0; n < 3; ++n) lever[i][k] -= r[n][i] * t_cross[n][k];
    }
  add_propagated_covariance(minus_r_transposed, lever, minus_r_transposed, a_b.covariance, out.covariance);
  return out;
}

/// T_world_probe for a device that detects the tag on the probe: the pose of the device in the world, of the tag in the
/// device's frame, and of the tag in the probe's frame. A tag's frame: origin in its centre, +X right, +Y up, +Z
/// towards the viewer. Poses of a detector with the _cv convention (z into the tag) must be rotated by pi about X
/// first.
[[nodiscard]] inline UncertainPose probe_from_own_tag(const UncertainPose& world_device,
                                                      const UncertainPose& device_tag, const UncertainPose& probe_tag) {
  return compose(compose(world_device, device_tag), inverse(probe_tag));
}

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
