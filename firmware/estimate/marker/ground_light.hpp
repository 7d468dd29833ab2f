// Light that the ground plane (the table) sends to the place of the body, as if the body were absent.
#pragma once

#include <array>
#include <span>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Irradiance of a small surface in the body's centre by the ground plane alone, without the body and its shadow, at a
/// normal: out[0] + dot((out[1], out[2], out[3]), normal), in the units of GroundSample::color times sr. `lights`:
/// directions and inverse distances; their irradiances are ignored. Zero without ground samples.
/// The plane's radiance is a nonnegative combination of an ambient term and one term per light, fitted to the samples
/// with the body's shadows. It is taken as infinite, with the radiance of the nearest sampled circle beyond the
/// samples.
[[nodiscard]] std::array<Rgb, 4> unoccluded_ground_irradiance(const Shading& shading,
                                                              std::span<const PointLight> lights);

}  // namespace lightwell::marker
