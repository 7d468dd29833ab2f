// The lights of a descriptor as an object sees them.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <lightwell/image_object.hpp>

namespace lightwell {
namespace {

bool has_values(Validity validity) { return validity == Validity::valid || validity == Validity::stale; }

bool has_irradiance(const Irradiance& e) { return e.r > 0 || e.g > 0 || e.b > 0; }

}  // namespace

Status object_lights(const Lighting& lighting, const Pose& T_lighting_object, int residual_directions,
                     std::vector<ObjectLight>& lights) {
  if (!has_values(lighting.validity()))
    return {StatusCode::failed_precondition,
            "the lighting has no values (" + std::string(to_string(lighting.validity())) + "): " + lighting.reason()};
  const Quat& q = T_lighting_object.rotation;
  if (!is_finite(T_lighting_object.translation) || !(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w > 0) ||
      !std::isfinite(q.x + q.y + q.z + q.w))
    return invalid_argument("the pose of the object is not finite or has no rotation");
  if (residual_directions < 0 || static_cast<std::size_t>(residual_directions) > ObjectRelighter::kMaxLights / 2)
    return invalid_argument("residual_directions is " + std::to_string(residual_directions) + ": it must be 0 to 512");
  const Quat to_object = q.normalized().inverse();
  const Vec3d centre = T_lighting_object.translation, origin = lighting.origin().translation;
  std::vector<ObjectLight> found;
  for (const Light& light : lighting.lights()) {
    if (!has_irradiance(light.irradiance)) continue;
    Vec3d towards = vec_cast<double>(light.direction);
    float falloff = 1;
    if (const auto position = lighting.position(light)) {
      towards = *position - centre;
      const double there = dot(towards, towards), at_origin = dot(*position - origin, *position - origin);
      if (!(there > 0)) return invalid_argument("a light is at the object's origin: move the object or drop the light");
      falloff = static_cast<float>(at_origin / there);
    }
    if (!std::isfinite(falloff)) return invalid_argument("a light is too near to the object's origin");
    found.push_back({vec_cast<float>(rotate(to_object, normalized(towards))), light.irradiance * falloff,
                     light.angular_radius_rad});
  }
  const float solid_angle = 4 * std::numbers::pi_v<float> / static_cast<float>(std::max(1, residual_directions));
  // The cap of that solid angle.
  const float residual_radius = std::acos(std::max(0.0F, 1 - solid_angle / (2 * std::numbers::pi_v<float>)));
  for (int i = 0; i < residual_directions; ++i) {
    const Vec3d towards = fibonacci_direction(i, residual_directions);
    const auto radiance = lighting.radiance(vec_cast<float>(towards), 0);
    const Irradiance e{radiance.value.r * solid_angle, radiance.value.g * solid_angle, radiance.value.b * solid_angle};
    if (has_irradiance(e)) found.push_back({vec_cast<float>(rotate(to_object, towards)), e, residual_radius});
  }
  lights = std::move(found);
  return {};
}

}  // namespace lightwell
