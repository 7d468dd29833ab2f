// A simulated camera's options put into effect, before any picture is rendered: its world, its lenses, and which
// picture each frame shows.
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
  /// With what was left open filled in: the exposures, the height of an equirectangular picture, and the rate lowered
  /// to what the longest exposure and the readout allow.
  SimOptions options;
  RigParameters rig;
  sim::SanitizeCounts sanitize_counts;  ///< What had to be replaced in the panorama's file.
  RingPlan plan;
  sim::Scene scene;

  /// What rendering needs. Borrows from this world.
  [[nodiscard]] RingSource source() const;
  [[nodiscard]] ExposureTiming timing() const;
};

/// Frames of scene time in a second: the camera's rate, or 30 where it has none.
[[nodiscard]] double scene_rate(const SimOptions& options);
/// For how long a frame is being exposed: not at all by the ideal sensor, whose exposure is a scale.
[[nodiscard]] double exposing_s(const SimOptions& options, double exposure_s);

/// Errors of scene_path(), load_panorama(), make_rig(); resource_exhausted where not even one bracket fits into memory.
[[nodiscard]] Result<std::unique_ptr<SimWorld>> make_sim_world(SimOptions options);

}  // namespace lightwell
