// Evaluation of a descriptor: irradiance and radiance. Shared by the SDK, the firmware and the tests.
#pragma once

#include <span>

#include <lightwell/cap.hpp>
#include <lightwell/descriptor.hpp>

namespace lightwell {

/// Irradiance of the lights only, each clipped at the receiver's horizon; the normal may have any length.
[[nodiscard]] Irradiance lights_irradiance(std::span<const Light> lights, Vec3f normal);

/// radiance(d, r) of the lights only; d may have any length.
[[nodiscard]] Radiance lights_radiance(std::span<const Light> lights, Vec3f direction, const GgxLobe& lobe);

/// Irradiance of lights and harmonics at a unit normal. Can be slightly negative where the truncated series rings.
[[nodiscard]] Irradiance irradiance_at(const Descriptor& descriptor, Vec3f normal);

}  // namespace lightwell
