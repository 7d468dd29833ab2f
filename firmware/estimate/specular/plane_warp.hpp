// Resamples the picture of a plane to its texels, given the plane's pose.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "calibration/model/camera_model.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/specular/plane_texels.hpp"

namespace lightwell::specular {

/// The luminance where there is none.
inline constexpr float kMissing = std::numeric_limits<float>::quiet_NaN();

/// Reads once the part of a picture that shows the plane, and resamples it at any number of nearby poses. Pixels are
/// interpolated bilinearly. Positions in the picture are bilinear between the corners of tiles (for a pinhole an eighth
/// of the second difference: 0.02 px where a tile is 8 px wide and a fiftieth of its distance). Corners are projected
/// exactly at the nodes of a coarser grid and interpolated by a biquadratic in homogeneous coordinates between them.
/// For a pinhole this is exact; for other lenses the grid is refined until the third differences show an error of at
/// most kMaxCornerError_px. Reuses its memory. Not thread-safe.
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

  /// Mean luminance of cells of `cell` x `cell` texels (1, 2 or kTileEdge), row by row, from the cells' texels, or from
  /// the middles of a tile's four quarters. NaN where the tile is unseen or a pixel is saturated.
  void sample_luminance(const Pose& probe_plane, int cell, std::vector<float>& out);

  /// Error of the interpolated corners of tiles against their exact projection, px, as estimated from third
  /// differences.
  static constexpr double kMaxCornerError_px = 0.01;
  /// Position of a corner of a tile in the picture, px, as sample() interpolates it; NaN outside the lens's domain.
  struct Corner {
    float x = 0, y = 0;
  };
  /// Of all corners, row by row; valid until the next call.
  [[nodiscard]] std::span<const Corner> corners(const Pose& probe_plane);

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
  /// Calls `visit(tile row, tile column, row, column, pixel, offset, weights)` at `edge` x `edge` evenly spaced points
  /// of each tile that is inside the loaded part: bilinear weights of the pixel at `offset`, its right neighbour and
  /// the two below them.
  template <int edge, class Visit>
  void visit_points(const Pose& probe_plane, Visit&& visit);
  /// Projects every `stride`-th corner of a tile. Returns whether all of them are within the lens's domain.
  bool project_corners(const Pose& lens_plane, int stride);
  /// Bound of the error that interpolation between corners `stride` apart has, by third differences, px.
  [[nodiscard]] float interpolation_error(int stride) const;
  /// Fills the corners between those that are `stride` apart.
  void interpolate_corners(int stride);

  const RigParameters& rig_;
  PlaneTexels texels_;
  std::vector<CameraModel> cameras_;
  int lens_ = 0;
  int left_ = 0, top_ = 0, width_ = 0, height_ = 0;  ///< The loaded part.
  std::vector<Pixel> pixels_;
  std::vector<float> luminance_;    ///< Of pixels_; NaN where saturated.
  std::vector<Vec3f> homogeneous_;  ///< Of corners: (x w, y w, w).
  std::vector<Corner> corners_;
  estimate::LinearRow row_;
};

}  // namespace lightwell::specular
