// Light from a marker that the camera looks at: a body of known paper, whose faces and whose shadow tell where the
// lamps are.
//
//   frame ──BodyFinder──> T_probe_body ──sampler──> Shading ──light_choice──> lamps, light from all around ──>
//   Descriptor
//
// Directions are from the body's centre, in the probe's (the camera's) axes.
#pragma once

#include <cstdint>
#include <memory>

#include <lightwell/calibration.hpp>
#include <lightwell/config.hpp>
#include <lightwell/marker_body.hpp>

#include "estimate/estimator.hpp"
#include "estimate/marker/body_finder.hpp"
#include "estimate/marker/lighting_estimate.hpp"
#include "estimate/marker/sampler.hpp"

namespace lightwell {

struct MarkerOptions {
  EstimatorConfig config;
  std::uint32_t probe_id = 0;
  marker::SamplerOptions sampler;
  marker::LightingEstimateOptions choice;
};

/// What the last estimate was made from and what a descriptor has no field for.
struct MarkerReport {
  DetectedBody body;
  marker::SampleCounts counts;
  marker::LightingEstimate light;  ///< Irradiances in the descriptor's units.
};

/// estimate() returns not_found where the body is not in any picture of the bracket. Ceres and AprilTag allocate memory
/// in each estimate, so this estimator does.
class MarkerEstimator : public Estimator {
 public:
  [[nodiscard]] virtual const MarkerReport& report() const = 0;
};

/// invalid_argument for a rig, a body or options that are impossible.
[[nodiscard]] Result<std::unique_ptr<MarkerEstimator>> make_marker_estimator(const RigParameters& rig,
                                                                             const MarkerBody& body,
                                                                             std::unique_ptr<BodyFinder> finder,
                                                                             const MarkerOptions& options);

}  // namespace lightwell
