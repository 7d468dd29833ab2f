// Poses that say how sure they are, and how doubt goes from frame to frame.
//   UncertainPose                T_a_b and the covariance of its error
//   compose, inverse             T_a_c = T_a_b T_b_c, T_b_a
//   probe_from_own_tag           an AR device that sees the tag on the probe
//
// The error of T_a_b is (rotation, translation), six numbers in the axes of a: p_a = Exp(rotation) R p_b + t +
// translation. The rotation (rad) turns b about its own origin, so that it does not move that origin; the translation
// (m) does. What nothing is known of has infinite variance and zero covariance with all else.
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

/// [v]x m: the columns of m crossed with v.
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

/// Adds J C J' for J of blocks (turn, 0; lever, move). A row that an infinite variance reaches becomes infinite.
inline void add_propagated_covariance(const Matrix3& turn, const Matrix3& lever, const Matrix3& move, const PoseCovariance& c,
                        PoseCovariance& out) {
  PoseCovariance j{}, finite = c;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t k = 0; k < 3; ++k) {
      j[r][k] = turn[r][k];
      j[r + 3][k] = lever[r][k];
      j[r + 3][k + 3] = move[r][k];
    }
  std::array<bool, 6> lost{};
  for (std::size_t k = 0; k < 6; ++k) {
    if (std::isfinite(c[k][k])) continue;
    for (std::size_t r = 0; r < 6; ++r) {
      // Rounding in a rotation does not make a coefficient of what is zero.
      lost[r] = lost[r] || std::abs(j[r][k]) > 1e-12;
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
    if (!lost[r] && std::isfinite(out[r][r])) continue;
    for (std::size_t k = 0; k < 6; ++k) out[r][k] = out[k][r] = 0;
    out[r][r] = std::numeric_limits<double>::infinity();
  }
}

inline constexpr Matrix3 kZero{};
inline constexpr Matrix3 kIdentity{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

}  // namespace pose_detail

/// T_a_c, for errors that know nothing of each other.
[[nodiscard]] inline UncertainPose compose(const UncertainPose& a_b, const UncertainPose& b_c) {
  using namespace pose_detail;
  UncertainPose out{compose(a_b.pose, b_c.pose), {}};
  const Matrix3 r = matrix_of(a_b.pose.rotation);
  // A turn of b about its origin carries c's origin along: w x (R t).
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
  Matrix3 turn{}, lever{};
  const Matrix3 across = crossed(a_b.pose.translation, kIdentity);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      turn[i][k] = -r[k][i];
      for (std::size_t n = 0; n < 3; ++n) lever[i][k] -= r[n][i] * across[n][k];
    }
  add_propagated_covariance(turn, lever, turn, a_b.covariance, out.covariance);
  return out;
}

/// Where the probe is in the world of a device that sees the tag on the probe: the device's own pose, the tag's pose in
/// the device's frame, and where on the probe the tag is. A tag's frame: origin in its centre, +X right, +Y up, +Z
/// towards who reads it. A detector that speaks _cv of tags (z into the wall) is turned by half a turn about X first.
[[nodiscard]] inline UncertainPose probe_from_own_tag(const UncertainPose& world_device,
                                                      const UncertainPose& device_tag, const UncertainPose& probe_tag) {
  return compose(compose(world_device, device_tag), inverse(probe_tag));
}

}  // namespace lightwell
