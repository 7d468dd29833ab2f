// Poses with covariance, and first-order propagation of the covariance through composition and inversion.
//   UncertainPose                T_a_b and the covariance of its error
//   compose, inverse             T_a_c = T_a_b T_b_c, T_b_a
//   probe_from_own_tag           T_world_probe from an AR device that detects the tag on the probe
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
  Matrix3 m{};
  const std::array<Vec3d, 3> columns = {rotate(q, Vec3d{1, 0, 0}), rotate(q, Vec3d{0, 1, 0}),
                                        rotate(q, Vec3d{0, 0, 1})};
  for (std::size_t i = 0; i < 3; ++i) {
    m[0][i] = columns[i].x;
    m[1][i] = columns[i].y;
    m[2][i] = columns[i].z;
  }
  return m;
}

/// [v]x m: the cross product of v with each column of m.
[[nodiscard]] constexpr Matrix3 crossed(Vec3d v, const Matrix3& m) {
  Matrix3 out{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d c = cross(v, Vec3d{m[0][i], m[1][i], m[2][i]});
    out[0][i] = c.x;
    out[1][i] = c.y;
    out[2][i] = c.z;
  }
  return out;
}

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
  Matrix3 lever = crossed(rotate(a_b.pose.rotation, b_c.pose.translation), kIdentity);
  for (auto& row : lever)
    for (double& v : row) v = -v;
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
  const Matrix3 t_cross = crossed(a_b.pose.translation, kIdentity);
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

}  // namespace lightwell
