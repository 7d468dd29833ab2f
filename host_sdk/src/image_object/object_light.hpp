// Checks of lights.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

#include <lightwell/image_object.hpp>
#include <lightwell/result.hpp>

namespace lightwell::image_object {

/// invalid_argument, naming the light, for a direction that is zero or not finite, an irradiance that is negative or
/// not finite, and a radius that is not 0 to pi / 2.
[[nodiscard]] inline Status check_light(const ObjectLight& light, std::size_t index) {
  const Vec3f d = normalized(light.direction);
  const Irradiance& e = light.irradiance;
  const std::string which = "light " + std::to_string(index);
  if (!(dot(d, d) > 0))
    return invalid_argument(which + " has a direction that is zero or not finite: a light cannot be at the object");
  if (!(e.r >= 0 && e.g >= 0 && e.b >= 0) || !std::isfinite(e.r + e.g + e.b))
    return invalid_argument(which + " has an irradiance that is negative or not finite");
  if (!(light.angular_radius_rad >= 0 && light.angular_radius_rad <= std::numbers::pi_v<float> / 2))
    return invalid_argument(which + " has an angular radius that is not 0 to pi / 2");
  return {};
}

}  // namespace lightwell::image_object
