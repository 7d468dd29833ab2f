// Evaluation of a descriptor: irradiance, radiance, positions of lights. Shared by the SDK, the firmware and the tests.
#pragma once

#include <optional>
#include <span>

#include <lightwell/cap.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell {

/// Cosine of the angle between two vectors of any length. In double, because near 1 a float's cosine cannot resolve
/// angles inside of a narrow lobe or the sun's disc.
[[nodiscard]] inline double cos_between(Vec3f a, Vec3f b) {
  return dot(normalized(vec_cast<double>(a)), normalized(vec_cast<double>(b)));
}

/// Position of a near lamp, m, in frame a; nullopt if its distance is not known. `light`: its direction in the axes of
/// a. `T_a_origin`: Descriptor::T_probe_origin, or that in another frame.
[[nodiscard]] inline std::optional<Vec3d> light_position(const Light& light, const Pose& T_a_origin) {
  if (!(light.distance_m > 0)) return std::nullopt;
  const Vec3d to_lamp = normalized(vec_cast<double>(light.direction)) * static_cast<double>(light.distance_m);
  return T_a_origin.translation + to_lamp;
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
