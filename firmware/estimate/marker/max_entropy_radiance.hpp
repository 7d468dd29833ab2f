// Maximum-entropy radiance: the most uniform radiance over the sphere that reproduces the surfaces' irradiances. Many
// light distributions explain a few faces; this one concentrates light only where the faces require it, is nowhere
// negative, and interpolates smoothly at normals between those of the faces.
//
// Radiance x(d) = m exp(sum over surfaces of mu max(0, n . d)) with a uniform m has the largest entropy relative to m
// of all radiances whose irradiances agree with the surfaces' within their errors (Jaynes 1957, "Information theory and
// statistical mechanics"; with errors: Skilling & Bryan 1984, "Maximum entropy image reconstruction: general
// algorithm"). mu, one number per surface, minimizes a convex function (the dual).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <lightwell/harmonics.hpp>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

struct MaxEntropyRadiance {
  /// Probe frame; the samples' unit of irradiance per steradian. Without the part in `lights`.
  RadianceSh radiance;
  /// By requested direction: irradiance of the radiance above its surroundings within 0.35 rad, at normal incidence.
  std::vector<Rgb> lights;
};

/// `samples`: sorted by surface, as in Shading. `toward`: unit vectors of possible lights. `band`: last SH band of the
/// radiance, 0 to kMaxBand. nullopt where there are no samples or all irradiances are 0.
[[nodiscard]] std::optional<MaxEntropyRadiance> max_entropy_radiance(std::span<const SurfaceSample> samples,
                                                                     std::span<const Vec3d> toward, int band);

}  // namespace lightwell::marker
