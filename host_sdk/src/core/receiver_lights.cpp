#include "core/receiver_lights.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/cap.hpp>

namespace lightwell::core {

std::vector<ReceiverLight> receiver_lights(std::span<const Light> lights) {
  std::vector<ReceiverLight> out;
  out.reserve(lights.size());
  for (const Light& light : lights) {
    const Vec3d direction = normalized(vec_cast<double>(light.direction));
    if (direction == Vec3d{}) continue;
    const double radius = light.angular_radius_rad;
    out.push_back({direction, std::sin(std::clamp(radius, 0.0, std::numbers::pi / 2)), radius, light.irradiance});
  }
  return out;
}

Irradiance irradiance_on(std::span<const ReceiverLight> lights, Vec3d normal) {
  Irradiance sum;
  for (const ReceiverLight& light : lights) {
    const double cosine = dot(light.direction, normal);
    if (cosine <= -light.sin_radius) continue;
    // Where the whole cap is above the horizon, the ratio is the cosine.
    const double ratio = cosine >= light.sin_radius ? cosine : cap_irradiance(cosine, light.radius_rad);
    sum += light.irradiance * static_cast<float>(ratio);
  }
  return sum;
}

}  // namespace lightwell::core
