// What each pixel of a rig sees, worked out once: direction, solid angle, share of it where lenses overlap.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// The pixels [first, end) of a row that see something.
struct RowSpan {
  int first = 0, end = 0;
};

/// One lens's pixels, rows from the top. Entries of pixels that see nothing are zero.
struct LensTable {
  int width = 0, height = 0;
  bool equirectangular = false;           ///< Rows close on themselves, the first and last across a pole.
  std::vector<RowSpan> rows;              ///< All pixels with a solid angle lie inside; some inside may have none.
  std::vector<Vec3f> direction;           ///< Unit, probe frame.
  std::vector<float> solid_angle;         ///< sr, exact for the pixel's four corners, times its share in the overlap.
  std::vector<float> inverse_vignetting;  ///< 1 / relative illumination, 1 where there is no vignetting.
  /// Where the other lens sees the same direction: index of that pixel there, or -1.
  std::vector<std::int32_t> twin;
};

struct RigTable {
  std::vector<LensTable> lenses;
  double covered_sr = 0;  ///< Sum of all solid angles: 4 pi where the rig sees everything.
};

/// invalid_argument where `rig` is impossible. Solid angles: two spherical triangles a pixel (Van Oosterom & Strackee
/// 1983, eq. 8); exact strips for equirectangular pictures. In the overlap of two lenses each counts by a weight that
/// falls linearly to zero over the last `feather_rad` before its max_angle, the weights of a direction summing to one.
[[nodiscard]] Result<RigTable> make_rig_table(const RigParameters& rig, double feather_rad = 0.05);

/// Of its pictures, in pixels.
[[nodiscard]] int max_image_width(const RigTable& table);

/// Side of a pixel of mean solid angle, rad.
[[nodiscard]] double pixel_side(const RigTable& table);

}  // namespace lightwell
