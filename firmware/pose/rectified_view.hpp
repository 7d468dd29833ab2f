// Pinhole views of a fisheye picture, in which straight edges are straight.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "calibration/model/camera_model.hpp"
#include "pose/grey_picture.hpp"

namespace lightwell {

/// Orientation and intrinsics of a square pinhole view.
struct ViewAxes {
  Vec3d right, down, forward;  ///< Unit vectors in the lens's _cv frame.
  double focal_px = 0;
  int size = 0;  ///< Pixels per side; the principal point is the centre.
};

class RectifiedView {
 public:
  /// Pixels outside the field of view or the picture are grey (128).
  RectifiedView(const GreyPicture& picture, const CameraModel& lens, const ViewAxes& axes);

  [[nodiscard]] GreyPicture picture() const;
  /// Maps a pixel of the view to the original picture; nullopt outside the field of view.
  [[nodiscard]] std::optional<PixelPosition> original(const CameraModel& lens, PixelPosition in_view) const;

 private:
  ViewAxes axes_;
  std::vector<std::uint8_t> pixels_;
};

/// Views that together cover the centre of a lens and its field from `beyond_rad` (angle from the axis) outwards, each
/// with about the resolution of the picture there. Neighbours overlap by 35 degrees, so that a narrower tag is complete
/// in one of them. Empty if the picture, whatever the model's range, does not extend to `beyond_rad`.
[[nodiscard]] std::vector<ViewAxes> views_of(const CameraModel& lens, int width, int height, double beyond_rad);

}  // namespace lightwell
