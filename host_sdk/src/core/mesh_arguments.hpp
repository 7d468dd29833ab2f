// Checks of the arguments of functions that take meshes and textures.
#pragma once

#include <cmath>
#include <cstddef>
#include <string>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/shadows.hpp>

namespace lightwell::core {

/// Finite, with a rotation that is not zero.
[[nodiscard]] inline bool is_usable(const Pose& pose) {
  const Quat& q = pose.rotation;
  const double norm2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  return norm2 > 0 && std::isfinite(norm2) && is_finite(pose.translation);
}

[[nodiscard]] inline Pose with_unit_rotation(const Pose& pose) {
  return {pose.rotation.normalized(), pose.translation};
}

/// invalid_argument if the value is out of range.
[[nodiscard]] Status check_range(const char* name, int value, int least, int most);

/// invalid_argument for a pose that is not finite, and for indices out of range or not three for each triangle.
[[nodiscard]] Status check_mesh(const ShadowMesh& mesh);

/// invalid_argument if `elements` is not columns * rows; `what` are the elements.
[[nodiscard]] Status check_texels(const char* what, std::size_t elements, int columns, int rows);

}  // namespace lightwell::core
