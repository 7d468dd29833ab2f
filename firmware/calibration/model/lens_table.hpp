// Precomputed tables of a rig: direction, solid angle and overlap weight of each pixel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// Columns [first, end) of a row that are inside the field of view.
struct RowSpan {
  int first = 0, end = 0;
};

/// Tables of one lens by pixel, rows from the top. Entries outside the field of view are zero.
struct LensTable {
  int width = 0, height = 0;
  bool equirectangular = false;           ///< Rows wrap around; the first and the last row adjoin across the poles.
  std::vector<RowSpan> rows;              ///< Contain all pixels with a solid angle; some pixels inside may have none.
  std::vector<Vec3f> direction;           ///< Unit, probe frame.
  std::vector<float> solid_angle;         ///< sr, of the polygon of the pixel's corners, times its overlap weight.
  std::vector<float> inverse_vignetting;  ///< 1 / relative illumination; 1 without vignetting.
  /// Index of the pixel of the other lens that sees the same direction; -1: none.
  std::vector<std::int32_t> overlap_pixel;

  /// Index of a pixel in these tables.
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

struct RigTable {
  std::vector<LensTable> lenses;
  double covered_sr = 0;  ///< Sum of all solid angles: 4 pi if the rig covers the sphere.
};

/// invalid_argument if `rig` is invalid. Solid angles: two spherical triangles per pixel (Van Oosterom & Strackee 1983,
/// eq. 8); exact for equirectangular pictures. In the overlap of two lenses the weight of each falls linearly to zero
/// over the last `feather_rad` before its max_angle; the weights of a direction sum to one.
[[nodiscard]] Result<RigTable> make_rig_table(const RigParameters& rig, double feather_rad = 0.05);

/// Largest image width of the rig's lenses, pixels.
[[nodiscard]] int max_image_width(const RigTable& table);

/// Angular side length of a pixel of mean solid angle, rad.
[[nodiscard]] double pixel_side(const RigTable& table);

}  // namespace lightwell
