// The resolved configuration of a simulated camera, before rendering: scene, rig, and the plan of pictures.
#pragma once

#include <memory>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "camera/backends/sim/frame_ring.hpp"
#include "camera/backends/sim/sim_options.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"

namespace lightwell {

struct SimWorld {
  /// Resolved options: default exposures and the height of an equirectangular picture filled in, and the frame rate
  /// reduced to what the longest exposure and the readout allow.
  SimOptions options;
  RigParameters rig;
  sim::SanitizeCounts sanitize_counts;  ///< Replaced values of the panorama file.
  RingPlan plan;
  sim::Scene scene;

  /// Inputs of rendering; refers to this object.
  [[nodiscard]] RingSource source() const;
  [[nodiscard]] ExposureTiming timing() const;
};

/// Frames per second of scene time: the camera's frame rate, or 30 if it has none.
[[nodiscard]] double scene_rate(const SimOptions& options);
/// Duration of an exposure, s; 0 for the ideal sensor, whose exposure is a scale factor.
[[nodiscard]] double exposing_s(const SimOptions& options, double exposure_s);

/// Errors of scene_path(), load_panorama(), make_rig(); resource_exhausted if not even one bracket fits into memory.
[[nodiscard]] Result<std::unique_ptr<SimWorld>> make_sim_world(SimOptions options);

}  // namespace lightwell
