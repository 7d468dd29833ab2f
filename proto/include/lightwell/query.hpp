// Evaluation of a descriptor: irradiance and radiance. Shared by the SDK, the firmware and the tests.
#pragma once

#include <span>

#include <lightwell/cap.hpp>
#include <lightwell/descriptor.hpp>

namespace lightwell {

/// Cosine of the angle between two vectors of any length. In double, because near 1 a float's cosine cannot resolve
/// angles inside of a narrow lobe or the sun's disc.
[[nodiscard]] inline double cos_between(Vec3f a, Vec3f b) {
  return dot(normalized(vec_cast<double>(a)), normalized(vec_cast<double>(b)));
}

/// radiance(d, r) of the lights only; d may have any length.
[[nodiscard]] inline Radiance lights_radiance(std::span<const Light> lights, Vec3f direction, const GgxLobe& lobe) {
  Radiance sum;
  for (const Light& light : lights) {
    const double c = cos_between(light.direction, direction);
    const auto k = static_cast<float>(cap_radiance(c, light.angular_radius_rad, lobe));
    sum += {light.irradiance.r * k, light.irradiance.g * k, light.irradiance.b * k};
  }
  return sum;
}

/// Irradiance of lights, each clipped at the receiver's horizon, and harmonics at a unit normal. Can be slightly
/// negative where the truncated series rings.
[[nodiscard]] inline Irradiance irradiance_at(const Descriptor& descriptor, Vec3f normal) {
  Irradiance lights;
  for (const Light& light : descriptor.lights) {
    const double c = cos_between(light.direction, normal);
    lights += light.irradiance * static_cast<float>(cap_irradiance(c, light.angular_radius_rad));
  }
  return evaluate(irradiance_of(descriptor.radiance), normal) + lights;
}

}  // namespace lightwell
