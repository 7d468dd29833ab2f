// A part of a fisheye picture as a pinhole camera would have taken it: straight edges are straight there.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "calibration/camera_model.hpp"
#include "pose/grey_picture.hpp"

namespace lightwell {

/// Where a pinhole view looks.
struct ViewAxes {
  Vec3d right, down, forward;  ///< Unit vectors in the lens's _cv axes.
  double focal_px = 0;
  int size = 0;  ///< Pixels a side; the axis meets the middle.
};

class RectifiedView {
 public:
  /// Where the lens sees nothing the view is grey.
  RectifiedView(const GreyPicture& picture, const CameraModel& lens, const ViewAxes& axes);

  [[nodiscard]] GreyPicture picture() const;
  /// A place in the view as a pixel of the original; nothing where the lens does not see it.
  [[nodiscard]] std::optional<PixelPosition> original(const CameraModel& lens, PixelPosition in_view) const;

 private:
  ViewAxes axes_;
  std::vector<std::uint8_t> pixels_;
};

/// Views that together cover a lens from `beyond_rad` outwards and its middle, each about as fine as the picture there;
/// neighbours share 35 degrees, so that a tag narrower than that is whole in one. None where the picture does not reach
/// `beyond_rad`: a model may go on far beyond the picture's edge.
[[nodiscard]] std::vector<ViewAxes> views_of(const CameraModel& lens, int width, int height, double beyond_rad);

}  // namespace lightwell
