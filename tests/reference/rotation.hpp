// Rotations as 3x3 matrices, in double.
#pragma once

#include <array>

#include "reference/vector.hpp"

namespace lightwell::reference {

/// A 3x3 matrix by rows.
using M3 = std::array<V3, 3>;

/// The vector m v.
inline V3 rotated(const M3& m, const V3& v) { return {dot(m[0], v), dot(m[1], v), dot(m[2], v)}; }

/// The transpose, which is a rotation's inverse.
inline M3 transposed(const M3& m) {
  return {V3{m[0].x, m[1].x, m[2].x}, V3{m[0].y, m[1].y, m[2].y}, V3{m[0].z, m[1].z, m[2].z}};
}

/// The right-handed rotation by `angle_rad` about `axis` (any length but zero).
/// Rodrigues: v cos a + (k x v) sin a + k (k.v)(1 - cos a), applied to the three unit vectors.
inline M3 rotation_about(const V3& axis, double angle_rad) {
  const V3 k = normalised(axis);
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  const auto turn = [&](const V3& v) { return c * v + s * cross(k, v) + (dot(k, v) * (1.0 - c)) * k; };
  return transposed({turn({1, 0, 0}), turn({0, 1, 0}), turn({0, 0, 1})});
}

}  // namespace lightwell::reference
