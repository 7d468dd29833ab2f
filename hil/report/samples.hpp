// Light as a list of directions with their share of it: what the pictures' objects are lit by, whether it comes from a
// descriptor or from the true panorama.
#pragma once

#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>

#include "sim/panorama.hpp"

namespace lightwell::hil {

struct LightSample {
  Vec3f direction;  ///< Unit, towards the light.
  Radiance flux;    ///< Radiance times solid angle.
};

/// The caps of the lights, each as many directions within it, and radiance(d, 0), which has none of them and is never
/// negative, at directions all around.
[[nodiscard]] std::vector<LightSample> samples_of(const Lighting& lighting);

/// Every pixel of the panorama, joined four by four, as the probe sees it: turned by the inverse of R_world_probe.
[[nodiscard]] std::vector<LightSample> samples_of(const sim::Panorama& panorama, Quat rotation_world_probe);

/// A list that gives nearly the same light with `count` entries: drawn by luminance, stratified, repeatable. Neighbours
/// in the list must be neighbours on the sphere, as the panorama's are: what is passed over goes to the next one drawn.
[[nodiscard]] std::vector<LightSample> thinned(const std::vector<LightSample>& samples, std::size_t count);

}  // namespace lightwell::hil
