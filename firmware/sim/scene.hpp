// A scene: a panorama with a rotating probe and switching lamps, both pure functions of the frame index, so that the
// ground truth of every frame is known; mains flicker; the radiance that a lens projects onto each photosite.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/lens_table.hpp"
#include "sim/panorama.hpp"

namespace lightwell::sim {

/// Modulates all radiance of a scene, as if its lamps lit everything: L(t) = L (1 + depth sin(2 pi hz t)).
struct MainsFlicker {
  double hz = 0;     ///< Frequency of the light, Hz: twice the mains frequency. 0: steady.
  double depth = 0;  ///< Modulation depth, 0 to 1; with 1 the light is dark once per period.

  /// Mean of 1 + depth sin(2 pi hz t) over an exposure of `exposure_s` centred at `middle_s`:
  /// 1 + depth sinc(pi hz exposure) sin(2 pi hz middle). With an exposure of 0 s, the value at `middle_s`.
  [[nodiscard]] double factor(double middle_s, double exposure_s) const;
};

/// Changes from frame to frame; none by default.
struct Motion {
  /// Angular velocity of the probe about +Y, right-handed: forward for half a cycle and back, so that a ring closes.
  double turn_rad_per_s = 0;
  double frame_rate = 30;          ///< Frames per second of scene time.
  std::uint64_t cycle_frames = 1;  ///< Period of the scene, frames.
  /// Frames after which the lamps switch; 0: they stay on.
  std::uint64_t switch_period_frames = 0;
  double off_factor = 0.05;  ///< Factor on the lamps' radiance while they are off.
};

/// The state of the scene in one frame.
struct SceneState {
  Quat rotation_world_probe;  ///< R_world_probe: the world is the panorama's frame.
  double yaw_rad = 0;         ///< The same rotation as an angle about +Y.
  double lamp_factor = 1;     ///< 1 or Motion::off_factor.
};

class Scene {
 public:
  /// The lamps are all pixels with a luminance above a quarter of the panorama's peak.
  explicit Scene(Panorama panorama, Motion motion = {});

  /// The state at frame `index`, of any value. `offset_s` is added to the frame's time for the rotation of the probe
  /// (not for the lamps, which switch between frames): the state seen by a row of a rolling shutter.
  [[nodiscard]] SceneState state_at(std::uint64_t index, double offset_s = 0) const;

  /// Radiance from a direction in the probe frame.
  [[nodiscard]] Radiance radiance(Vec3d direction_probe, const SceneState& state) const;

  /// The panorama with the lamps as in `state`.
  [[nodiscard]] const Panorama& panorama(const SceneState& state) const {
    return state.lamp_factor < 1 ? lamps_off_ : lamps_on_;
  }
  [[nodiscard]] const HighlightMask& highlights(const SceneState& state) const {
    return state.lamp_factor < 1 ? highlights_off_ : highlights_on_;
  }
  [[nodiscard]] const Motion& motion() const { return motion_; }

 private:
  Panorama lamps_on_;
  Panorama lamps_off_;  ///< Empty if the lamps never switch.
  HighlightMask highlights_on_, highlights_off_;
  Motion motion_;
};

/// Sample directions of a lens, precomputed: n x n on a regular grid inside each pixel.
class LensRays {
 public:
  /// 1 <= samples_per_axis <= 8. Takes 8 n² bytes per pixel in the field of view.
  LensRays(const LensParameters& lens, int samples_per_axis);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// Renders rows [rows.first, rows.end): each pixel is the mean radiance of those of its samples that are in the field
  /// of view, 0 if none is. A pixel with a sample in Scene::highlights() is sampled four times as densely in each
  /// direction; otherwise the energy of a sun would depend on its position relative to the samples. `out`: the whole
  /// picture, r, g, b per pixel. No allocation.
  void render(const Scene& scene, const SceneState& state, RowSpan rows, std::span<float> out) const;

 private:
  [[nodiscard]] int sample_pixel(int column, int row, std::vector<SpherePoint>& out) const;
  [[nodiscard]] RowSpan sample_row(int row);
  [[nodiscard]] Radiance supersample(const Panorama& world, std::uint32_t shift, int column, int row) const;

  CameraModel model_;
  Quat to_probe_;
  int width_, height_;
  int per_axis_;
  std::vector<RowSpan> rows_;           ///< Pixels in the field of view.
  std::vector<std::size_t> row_start_;  ///< By row: index of its first pixel among the pixels of all spans.
  std::vector<SpherePoint> samples_;    ///< n² per pixel of the spans, probe frame.
  std::vector<std::uint8_t> seen_;      ///< Per pixel: number of valid samples; these come first.
};

/// Samples per axis so that neighbouring samples are half a panorama pixel apart on the lens's axis; 2 to 8.
[[nodiscard]] int samples_for(const LensParameters& lens, const Panorama& panorama);

/// Renders a whole picture in one state of the scene.
[[nodiscard]] std::vector<float> render_radiance(const Scene& scene, const SceneState& state,
                                                 const LensParameters& lens, int samples_per_axis = 2);

}  // namespace lightwell::sim
