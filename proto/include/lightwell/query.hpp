// What a descriptor says of a point: the definitions, written once for the SDK, the firmware and the tests.
#pragma once

#include <span>

#include <lightwell/cap.hpp>
#include <lightwell/descriptor.hpp>

namespace lightwell {

/// Irradiance of the lights alone at a normal of any length, each clipped at the receiver's horizon.
[[nodiscard]] Irradiance lights_irradiance(std::span<const Light> lights, Vec3f normal);

/// radiance(d, r) of the lights alone; d of any length.
[[nodiscard]] Radiance lights_radiance(std::span<const Light> lights, Vec3f direction, const GgxLobe& lobe);

/// Irradiance at a unit normal: the lights and the rest. May be slightly negative where harmonics ring.
[[nodiscard]] Irradiance irradiance_at(const Descriptor& descriptor, Vec3f normal);

}  // namespace lightwell
