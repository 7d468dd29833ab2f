// Resamples the picture of a plane to its texels, given the plane's pose.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "calibration/model/camera_model.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/specular/plane_texels.hpp"

namespace lightwell::specular {

/// Reads once the part of a picture that shows the plane, and resamples it at any number of nearby poses. Pixels are
/// interpolated bilinearly; the projection is exact at the corners of tiles and bilinear between them (for a
/// pinhole an eighth of the second difference: 0.02 px where a tile is 8 px wide and a fiftieth of its distance).
/// Reuses its memory. Not thread-safe.
class PlaneWarp {
 public:
  /// Refers to `rig`, which must be valid.
  PlaneWarp(const RigParameters& rig, const PlaneTexels& texels);

  /// Reads the pixels within `margin_px` of the plane at this pose, in the reader's units times `scale`. `reader` must
  /// be bound to the frame. Returns false where the plane is not in the picture, or seen from behind.
  [[nodiscard]] bool load(estimate::RowReader& reader, int lens, const Pose& probe_plane, double margin_px,
                          double scale);

  /// Texels at this pose; those whose tile is not inside the loaded part of the picture are unseen. `out` is resized.
  void sample(const Pose& probe_plane, TexelImage& out);

  /// Mean luminance of each tile, row by row, from the middles of its four quarters: a quarter of the time of sample().
  /// NaN where the tile is unseen or has a saturated pixel.
  void sample_tiles(const Pose& probe_plane, std::vector<float>& out);

  /// Position of the lens in the plane's frame, m.
  [[nodiscard]] Vec3d lens_in_plane(const Pose& probe_plane) const;

  /// Angle between neighbouring pixels in the direction of the plane's origin, rad; infinite where it is not in view.
  [[nodiscard]] double pixel_rad(const Pose& probe_plane) const;
  /// Length of a pixel on the plane in the direction in which it is longest, at the plane's origin, m.
  [[nodiscard]] double pixel_on_plane(const Pose& probe_plane) const {
    const Vec3d lens = lens_in_plane(probe_plane);
    return pixel_rad(probe_plane) * dot(lens, lens) / lens.z;
  }

 private:
  struct alignas(16) Pixel {
    float v[4];  ///< r, g, b; 1 where saturated.
  };
  struct Node {
    float x = 0, y = 0;  ///< In the picture, px.
    bool inside = false;
  };
  /// Calls `visit(tile row, tile column, row, column, pixel)` at `edge` x `edge` evenly spaced points of each tile that
  /// is inside the loaded part.
  template <int edge, class Visit>
  void visit_points(const Pose& probe_plane, Visit&& visit);
  /// Positions of the corners of all tiles. `stride`: 1 projects all of them, 2 every other one, with the rest halfway
  /// between. Returns the number of projected corners that are within the lens's domain.
  std::size_t project_nodes(const Pose& probe_plane, int stride);

  const RigParameters& rig_;
  PlaneTexels texels_;
  std::vector<CameraModel> cameras_;
  int lens_ = 0;
  int left_ = 0, top_ = 0, width_ = 0, height_ = 0;  ///< The loaded part.
  std::vector<Pixel> pixels_;
  std::vector<Node> nodes_;
  estimate::LinearRow row_;
};

}  // namespace lightwell::specular
