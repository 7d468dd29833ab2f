// What a lens sees of a scene, before any sensor: the radiance that reaches each photosite.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/camera_model.hpp"
#include "calibration/lens_table.hpp"
#include "sim/scene.hpp"

namespace lightwell::sim {

/// The directions that the photosites of a lens integrate over: n x n on a regular grid inside each
/// pixel. They depend on the lens alone: worked out once, so that a frame is lookups.
class LensRays {
 public:
  /// 1 <= samples_per_axis <= 8. Takes 8 n² bytes for each pixel that sees something.
  LensRays(const LensParameters& lens, int samples_per_axis);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// Rows [rows.first, rows.end) of the picture: each pixel the mean of the radiance over those of
  /// its samples that the lens sees, 0 where it sees none. A pixel with a sample in
  /// Scene::glare() is sampled four times as densely each way: the energy of a sun would otherwise
  /// depend on where it falls. `out` is the whole picture, r g b a pixel. Allocates nothing.
  void render(const Scene& scene, const SceneState& state, RowSpan rows, std::span<float> out) const;

 private:
  [[nodiscard]] int sample_pixel(int column, int row, std::vector<SpherePoint>& out) const;
  [[nodiscard]] RowSpan sample_row(int row);
  [[nodiscard]] Radiance supersample(const Panorama& world, std::uint32_t shift, int column, int row) const;

  CameraModel model_;
  Quat to_probe_;
  int width_, height_;
  int per_axis_;
  std::vector<RowSpan> rows_;           ///< Pixels that see anything.
  std::vector<std::size_t> row_start_;  ///< Index among the pixels of all spans of a row's first.
  std::vector<SpherePoint> samples_;    ///< n² for each pixel of the spans, in the probe's frame.
  std::vector<std::uint8_t> seen_;      ///< How many of a pixel's n² count; those come first.
};

/// So many that neighbouring samples lie half a pixel of the panorama apart on the lens's axis, 2
/// to 8.
[[nodiscard]] int samples_for(const LensParameters& lens, const Panorama& panorama);

/// A whole picture in one state of the scene.
[[nodiscard]] std::vector<float> render_radiance(const Scene& scene, const SceneState& state,
                                                 const LensParameters& lens, int samples_per_axis = 2);

}  // namespace lightwell::sim
