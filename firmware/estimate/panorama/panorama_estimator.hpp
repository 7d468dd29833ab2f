// Light from a camera that looks around: one pass over the pixels, lights by luminance, harmonics of the rest.
#pragma once

#include <memory>
#include <optional>

#include <lightwell/calibration.hpp>

#include "estimate/estimator.hpp"
#include "estimate/panorama/grey_patch.hpp"

namespace lightwell {

struct PanoramaOptions {
  EstimatorConfig config;
  std::uint32_t probe_id = 0;
  /// Pixels of a block's edge, a power of two up to 16. 0: about 3.2 degrees. Larger is faster; the bound's sampling
  /// part grows.
  int block_edge = 0;
  /// Where there is one, the energy of clipped lights is recovered from it in every frame.
  std::optional<GreyPatch> grey_patch;
};

/// invalid_argument for a rig or options that are impossible. Takes about half a second for two million pixels.
[[nodiscard]] Result<std::unique_ptr<Estimator>> make_panorama_estimator(const RigParameters& rig,
                                                                         const PanoramaOptions& options);

}  // namespace lightwell
