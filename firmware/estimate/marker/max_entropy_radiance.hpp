// Light of which nobody knows where it comes from. Few faces are lit alike by many lights; of all that explain them
// this is the one that is most even over the directions: it makes no lamp where none has to be, never takes light away,
// and stays near what was seen where normals lie between those that were.
//
// Radiance x(d) = m exp(sum over surfaces of mu max(0, n . d)), m even: the largest entropy relative to m of all whose
// irradiances are the surfaces' up to their errors (Jaynes 1957, "Information theory and statistical mechanics"; with
// errors: Skilling & Bryan 1984). mu is the minimum of a convex function of as many numbers as there are surfaces.
//   MaxEntropyRadiance, max_entropy_radiance
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <lightwell/harmonics.hpp>

#include "estimate/marker/fit_options.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

struct MaxEntropyRadiance {
  /// Probe's axes, units of the samples' irradiance a steradian; without what `lamps` has.
  RadianceSh radiance;
  /// Irradiance at normal incidence of what stands out of its surroundings about each direction that was asked for, in
  /// their order.
  std::vector<Rgb> lights;
};

/// `samples`: as Shading has them. `toward`: unit vectors, where lamps may be. `band`: of the radiance, 0 to kMaxBand.
/// Nothing where there are no samples, or none of them gets light.
[[nodiscard]] std::optional<MaxEntropyRadiance> max_entropy_radiance(std::span<const SurfaceSample> samples, const ErrorModel& errors,
                                                       std::span<const Vec3d> toward, int band);

}  // namespace lightwell::marker
