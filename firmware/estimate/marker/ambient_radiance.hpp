// The light of an estimate as a descriptor holds it: all light that arrives at the body's centre, the ground plane's
// included, as if the body were absent.
#pragma once

#include <lightwell/harmonics.hpp>

#include "estimate/marker/lighting_estimate.hpp"

namespace lightwell::marker {

/// Radiance without the lights, in the samples' unit of irradiance per steradian: the ambient light (band 1) or, where
/// the lights are uncertain and not localized, the maximum-entropy radiance (bands up to `band`, at most 4); each with
/// the light of the ground plane. The maximum-entropy radiance replaces the irradiances of the estimate's lights, and
/// reorders them.
[[nodiscard]] RadianceSh ambient_radiance(LightingEstimate& estimate, int band);

}  // namespace lightwell::marker
