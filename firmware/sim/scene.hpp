// A scene: a panorama in which the probe turns and lamps switch, both pure functions of the frame's
// number, so that a judge knows the truth of every frame.
#pragma once

#include <cstdint>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

#include "sim/highlight_mask.hpp"
#include "sim/panorama.hpp"

namespace lightwell::sim {

/// What changes from frame to frame. The defaults: nothing.
struct Motion {
  /// Of the probe about +Y, right-handed. It sweeps forward for half a cycle and back for the other
  /// half, so that a ring of frames closes without a jump.
  double turn_rad_per_s = 0;
  double frame_rate = 30;          ///< Frames of scene time in a second.
  std::uint64_t cycle_frames = 1;  ///< After so many frames everything repeats.
  /// The lamps change every so many frames; 0: they stay on.
  std::uint64_t switch_period_frames = 0;
  double off_factor = 0.05;  ///< What is left of the lamps' radiance while they are off.
};

/// The world as one frame sees it.
struct SceneState {
  Quat rotation_world_probe;  ///< R_world_probe: the world is the panorama's frame.
  double yaw_rad = 0;         ///< The same turn as an angle about +Y.
  double lamp_factor = 1;     ///< 1 or Motion::off_factor.
};

class Scene {
 public:
  /// The lamps are all pixels whose luminance is above a quarter of the panorama's peak.
  explicit Scene(Panorama panorama, Motion motion = {});

  /// The state at frame `index`, any index. `offset_s` moves the probe (not the lamps, which switch
  /// between frames) before or behind the frame's own time: what a row of a rolling shutter sees.
  [[nodiscard]] SceneState state_at(std::uint64_t index, double offset_s = 0) const;

  /// Radiance from a direction of the probe's frame.
  [[nodiscard]] Radiance radiance(Vec3d direction_probe, const SceneState& state) const;

  /// The world's radiance with the lamps as in `state`.
  [[nodiscard]] const Panorama& panorama(const SceneState& state) const {
    return state.lamp_factor < 1 ? lamps_off_ : lamps_on_;
  }
  [[nodiscard]] const HighlightMask& highlights(const SceneState& state) const {
    return state.lamp_factor < 1 ? highlights_off_ : highlights_on_;
  }
  [[nodiscard]] const Motion& motion() const { return motion_; }

 private:
  Panorama lamps_on_;
  Panorama lamps_off_;  ///< Empty where lamps never switch.
  HighlightMask highlights_on_, highlights_off_;
  Motion motion_;
};

}  // namespace lightwell::sim
