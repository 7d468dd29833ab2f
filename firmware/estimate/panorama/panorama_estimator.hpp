// Estimator for panoramic cameras: one pass over the pixels, detection of lights, spherical harmonics of the rest.
#pragma once

#include <memory>
#include <optional>

#include <lightwell/calibration.hpp>
#include <lightwell/config.hpp>

#include "estimate/estimator.hpp"

namespace lightwell {

struct PanoramaOptions {
  EstimatorConfig config;
  std::uint32_t probe_id = 0;
  /// Edge of a block in pixels, a power of two up to 16. 0: about 3.2 degrees. Larger: faster, with a larger bound.
  int block_edge = 0;
  /// If set, the energy of clipped lights is recovered from this patch in every frame.
  std::optional<GreyPatch> grey_patch;
};

/// Returns invalid_argument where the rig or an option is invalid. Takes about half a second for two million pixels.
[[nodiscard]] Result<std::unique_ptr<Estimator>> make_panorama_estimator(const RigParameters& rig,
                                                                         const PanoramaOptions& options);

}  // namespace lightwell
