// Values of the SDK as those of GLM.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::viewer {

template <class T>
[[nodiscard]] glm::vec3 to_glm(Vec3<T> v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

template <class Quantity>
[[nodiscard]] glm::vec3 to_glm(Rgb<Quantity> c) {
  return {c.r, c.g, c.b};
}

[[nodiscard]] inline glm::mat4 to_glm(const Pose& T_a_b) {
  const glm::dquat q(T_a_b.rotation.w, T_a_b.rotation.x, T_a_b.rotation.y, T_a_b.rotation.z);
  glm::dmat4 m = glm::mat4_cast(q);
  m[3] = glm::dvec4(T_a_b.translation.x, T_a_b.translation.y, T_a_b.translation.z, 1);
  return glm::mat4(m);
}

}  // namespace lightwell::viewer
