// Estimates the lighting from a marker in the camera's view: a body of known albedo. The shading of its faces and its
// shadow on the ground plane determine point lights and ambient light. The descriptor's origin is the body's centre;
// directions are in the probe's axes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <lightwell/calibration.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "estimate/estimator.hpp"
#include "estimate/marker/lighting_estimate.hpp"
#include "estimate/marker/sampler.hpp"

namespace lightwell {

struct DetectedBody {
  UncertainPose probe_body;  ///< T_probe_body.
  int tags = 0;              ///< Number of tags that agree with the pose.
  bool ambiguous = false;    ///< Another attitude explains the tags nearly as well.
  /// Standard deviation of the image's blur at the tags' edges, px; nullopt: not measured, taken as sharp.
  std::optional<double> blur_px;
};

/// Decimation of the image before tags are detected.
struct FinderDecimation {
  double full_search = 1.5;  ///< Of the whole image, 1 to 8.
  double tracked = 0;        ///< Of the part where the body is expected, 1 to 8; 0: depends on the size of the tags.
};

/// Interface to the tag detector: finds the body's pose in a frame. Takes all frames, in order. Not thread-safe.
class BodyFinder {
 public:
  virtual ~BodyFinder() = default;

  /// Takes effect with the next frame. The values must be in range.
  virtual void set_decimation(const FinderDecimation& decimation) = 0;

  /// nullopt where the body is not in the image. Returns invalid_argument where the frame cannot be read.
  [[nodiscard]] virtual Result<std::optional<DetectedBody>> find(const View& view, const FrameInfo& info) = 0;
};

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
