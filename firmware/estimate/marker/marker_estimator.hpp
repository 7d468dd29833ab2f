// Estimates the lighting from a marker in the camera's view: a body of known albedo. The shading of its faces and its
// shadow on the ground plane determine point lights and ambient light. The descriptor's origin is the body's centre;
// directions are in the probe's axes.
#pragma once

#include <cstdint>
#include <memory>

#include <lightwell/calibration.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/marker_body.hpp>

#include "estimate/estimator.hpp"
#include "estimate/frames/body_finder.hpp"
#include "estimate/marker/lighting_estimate.hpp"
#include "estimate/marker/sampler.hpp"

namespace lightwell {

struct MarkerOptions {
  EstimatorConfig config;
  std::uint32_t probe_id = 0;
  marker::SamplerOptions sampler;
};

/// Inputs and intermediate results of the last estimate.
struct MarkerReport {
  DetectedBody body;
  marker::SampleCounts counts;
  marker::LightingEstimate light;  ///< Irradiances in the descriptor's units.
};

/// estimate() returns not_found where no frame of the bracket shows the body. Ceres and AprilTag allocate memory.
class MarkerEstimator : public Estimator {
 public:
  [[nodiscard]] virtual const MarkerReport& report() const = 0;
};

/// Returns invalid_argument where the rig, the body or an option is invalid, or `finder` is null.
[[nodiscard]] Result<std::unique_ptr<MarkerEstimator>> make_marker_estimator(const RigParameters& rig,
                                                                             const MarkerBody& body,
                                                                             std::unique_ptr<BodyFinder> finder,
                                                                             const MarkerOptions& options);

}  // namespace lightwell
