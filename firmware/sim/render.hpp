// Renders the radiance that a lens projects onto each photosite, before the sensor model.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/lens_table.hpp"
#include "sim/scene.hpp"

namespace lightwell::sim {

/// Sample directions of a lens: n x n on a regular grid inside each pixel. They depend only on the lens and are
/// precomputed, so that rendering a frame consists of lookups.
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
