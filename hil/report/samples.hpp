// Light as a list of directional samples, from a descriptor or from the true panorama; it lights the objects of the
// picture.
#pragma once

#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>

#include "sim/panorama.hpp"

namespace lightwell::hil {

struct LightSample {
  Vec3f direction;  ///< Unit, towards the light.
  Radiance flux;    ///< Radiance times solid angle: irradiance normal to `direction`.
};

/// Samples of a descriptor: 64 directions in the cap of each light, and radiance(d, 0), which does not contain the
/// lights and is never negative, on an equirectangular grid.
[[nodiscard]] std::vector<LightSample> samples_of(const Lighting& lighting);

/// Samples of the panorama in the probe's frame, one per block of 4x4 pixels: rotated by the inverse of R_world_probe.
[[nodiscard]] std::vector<LightSample> samples_of(const sim::Panorama& panorama, Quat rotation_world_probe);

/// About `count` samples with nearly the same light, chosen deterministically by systematic sampling of the luminance.
/// The flux of skipped samples is added to the next chosen one, so neighbours in the list must be neighbours on the
/// sphere.
[[nodiscard]] std::vector<LightSample> thinned(const std::vector<LightSample>& samples, std::size_t count);

}  // namespace lightwell::hil
