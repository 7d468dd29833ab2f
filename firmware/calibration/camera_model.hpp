// Camera models: a pixel and a direction, both ways. Directions here are in the lens's own axes, _cv: x right, y down,
// z forward. Pixels: the centre of the top left one is (0, 0).
//   project    direction -> pixel          unproject  pixel -> direction
#pragma once

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <optional>

namespace lightwell {

struct PixelPosition {
  double x = 0, y = 0;
};

/// One lens's geometry. A value: cheap to copy, nothing is allocated.
class CameraModel {
 public:
  /// `lens` has passed RigParameters::validate().
  explicit CameraModel(const LensParameters& lens);

  /// Nothing outside the model's domain: beyond max_angle_rad, where the projection turns back, or for zero and NaN.
  /// The direction need not be normalised. The pixel may lie outside the picture.
  [[nodiscard]] std::optional<PixelPosition> project(Vec3d direction_cv) const;

  /// A unit vector; nothing where no direction within max_angle_rad lands on the pixel.
  [[nodiscard]] std::optional<Vec3d> unproject(PixelPosition pixel) const;

  [[nodiscard]] double max_angle_rad() const { return max_angle_; }

 private:
  ModelParameters model_;
  int width_, height_;
  double max_angle_;
};

}  // namespace lightwell
