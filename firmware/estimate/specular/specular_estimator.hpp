// Estimates the lighting from a glossy plane that the camera moves around: the plane's surface light field is captured,
// its specular part is deconvolved to the environment above the plane, and that is described as a panorama's is. The
// descriptor's origin is the middle of the plane, with its axes; directions are in the probe's axes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <lightwell/calibration.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/glossy_plane.hpp>

#include "estimate/estimator.hpp"
#include "estimate/frames/body_finder.hpp"
#include "estimate/specular/gloss_estimate.hpp"
#include "estimate/specular/plane_capture.hpp"

namespace lightwell {

struct SpecularOptions {
  EstimatorConfig config;
  std::uint32_t probe_id = 0;
  specular::CaptureOptions capture;  ///< `texels.size_m` is that of the plane.
  /// Frames from the start of one estimate of the environment to the start of the next, at least; while the roughness
  /// is searched for, the next one starts at once. An estimate is computed in steps, one after each frame: it ends 10
  /// (rough planes) to 38 (smooth ones) frames after its start, and descriptors have that of the last one that has
  /// ended.
  int frames_between_estimates = 30;
  /// Operations of a step (specular::WorkBudget): 10 ms on a desktop core. Fewer take less time in each frame and make
  /// an estimate longer, which has 45 to 190 million.
  std::size_t light_operations = 5'000'000;
  std::uint32_t plane_capture = 1;  ///< PlaneInfo::capture of captured_plane(): not 0, random for each run of a probe.
};

/// estimate() returns not_found where no frame of the bracket shows the plane's tags. Until the environment is known,
/// light is uniform above the plane, with Flag::unseen. It allocates memory where the capture grows, and
/// for an estimate of the environment. The frames alone determine the answers, not the time that they take.
/// captured_plane() is null until a frame was stored; its time and pose are those of the last stored frame, and its
/// radiance is in the units of the descriptors.
class SpecularEstimator : public Estimator {
 public:
  [[nodiscard]] virtual const specular::PlaneCapture& capture() const = 0;
  /// The last estimate of the environment; null before the first.
  [[nodiscard]] virtual const specular::GlossEstimate* gloss() const = 0;
  /// Whether another estimate of the environment has started and not ended.
  [[nodiscard]] virtual bool estimating() const = 0;
  /// Separates and estimates with all samples, which takes seconds: for pictures that are not a stream. The next
  /// descriptor contains it.
  virtual void finish() = 0;
};

/// Returns invalid_argument where the rig, the plane or an option is invalid, or `finder` is null.
[[nodiscard]] Result<std::unique_ptr<SpecularEstimator>> make_specular_estimator(const RigParameters& rig,
                                                                                 const GlossyPlane& plane,
                                                                                 std::unique_ptr<BodyFinder> finder,
                                                                                 const SpecularOptions& options);

}  // namespace lightwell
