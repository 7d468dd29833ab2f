// Conversions between Lightwell's and GLM's types. Optional: the only header that includes GLM (0.9.9 or later), which
// the application must find itself (Debian: libglm-dev, find_package(glm), glm::glm).
#pragma once

#include <array>
#include <cstddef>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <lightwell/color.hpp>
#include <lightwell/conventions.hpp>
#include <lightwell/exposure.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>

namespace lightwell {

[[nodiscard]] inline glm::vec3 to_glm(Vec3f v) { return {v.x, v.y, v.z}; }
[[nodiscard]] inline glm::dvec3 to_glm(Vec3d v) { return {v.x, v.y, v.z}; }
[[nodiscard]] inline Vec3f from_glm(const glm::vec3& v) { return {v.x, v.y, v.z}; }
[[nodiscard]] inline Vec3d from_glm(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// By members, because GLM's constructor takes w first or last, depending on version and macros.
[[nodiscard]] inline glm::dquat to_glm(const Quat& q) {
  glm::dquat out;
  out.x = q.x;
  out.y = q.y;
  out.z = q.z;
  out.w = q.w;
  return out;
}
[[nodiscard]] inline Quat from_glm(const glm::dquat& q) { return {q.x, q.y, q.z, q.w}; }
[[nodiscard]] inline Quat from_glm(const glm::quat& q) { return from_glm(glm::dquat(q)); }

/// The model matrix of T_a_b: to_glm(T_a_b) * vec4(p_b, 1) = vec4(p_a, 1). The rotation must be a unit quaternion.
[[nodiscard]] inline glm::dmat4 to_glm(const Pose& T_a_b) {
  glm::dmat4 out = glm::mat4_cast(to_glm(T_a_b.rotation));
  out[3] = glm::dvec4(to_glm(T_a_b.translation), 1);
  return out;
}

/// The matrix must be rigid, without scale, shear or reflection.
[[nodiscard]] inline Pose from_glm(const glm::dmat4& T_a_b) {
  return {from_glm(glm::quat_cast(glm::dmat3(T_a_b))), from_glm(glm::dvec3(T_a_b[3]))};
}

/// r, g, b of a radiance or an irradiance; the GLM type does not distinguish them.
template <class Quantity>
[[nodiscard]] glm::vec3 to_glm(const Rgb<Quantity>& c) {
  return {c.r, c.g, c.b};
}

/// color_from_glm<Radiance>(v).
template <class Color>
[[nodiscard]] Color color_from_glm(const glm::vec3& c) {
  return {c.r, c.g, c.b};
}

/// GLM's matrices are stored by columns: to_glm(m) * to_glm(c) = to_glm(m * c).
[[nodiscard]] inline glm::mat3 to_glm(const ColorMatrix& m) {
  glm::mat3 out;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      out[column][row] = m.m[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  return out;
}
[[nodiscard]] inline ColorMatrix from_glm(const glm::mat3& m) {
  ColorMatrix out;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      out.m[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] = m[column][row];
  return out;
}

/// Coefficients up to `Band`, r g b in xyz and 0 in w: an array of vec3 has the stride of vec4 in a uniform block.
/// Bands that `sh` does not have are zero, those above `Band` are omitted. Basis as in harmonics.hpp, in Lightwell's
/// axes.
template <int Band, class Quantity>
[[nodiscard]] std::array<glm::vec4, static_cast<std::size_t>(sh_count(Band))> sh_uniform(const Sh<Quantity>& sh) {
  static_assert(Band >= 0 && Band <= kMaxBand);
  std::array<glm::vec4, static_cast<std::size_t>(sh_count(Band))> out;
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<int>(i) < sh.count() ? glm::vec4(to_glm(sh.c[i]), 0) : glm::vec4(0);
  return out;
}

/// For a custom shader, in right-handed, +Y up axes. With `uniform vec4 sh[9]` and the unit normal n,
///   vec3 e = sh[0].rgb + sh[1].rgb * n.y + sh[2].rgb * n.z + sh[3].rgb * n.x + sh[4].rgb * (n.x * n.y)
///          + sh[5].rgb * (n.y * n.z) + sh[6].rgb * (3.0 * n.z * n.z - 1.0) + sh[7].rgb * (n.x * n.z)
///          + sh[8].rgb * (n.x * n.x - n.y * n.y);
/// is the irradiance OVER PI, which times albedo is the radiance of a matte surface. The main light is separate, in
/// `direction`, `color` and `intensity` (lux: divide by pi).
[[nodiscard]] inline std::array<glm::vec4, 9> irradiance_uniform(const FilamentLighting& light) {
  std::array<glm::vec4, 9> out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto& c = light.irradiance[i];
    out[i] = glm::vec4(c[0], c[1], c[2], 0) * light.indirectIntensity;
  }
  return out;
}

}  // namespace lightwell
