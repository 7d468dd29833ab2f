// Where the corners of a tag are, from the light on both sides of its edges.
//
// Along each of the two edges that meet in a corner a picture of a blurred edge is fitted to the pixels:
//   I(p) = inside + (outside - inside) S(d(p))
// d is the distance from a parabola, which is what a straight edge is through a fisheye lens for a few dozen pixels;
// S a step behind a normal blur, of a width that is fitted too, and behind the area of a square pixel.
// The corner is where both curves meet. Pixels close to the corner are left out, as blur rounds it.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "calibration/camera_model.hpp"
#include "pose/grey_picture.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {

struct RefinedCorner {
  PixelPosition at;
  PixelCovariance covariance;
};

/// What is known of a tag's outline before.
struct TagOutline {
  std::array<PixelPosition, 4> corners{};  ///< In order around the tag; good to a few pixels.
  int edge_cells = 8;                      ///< Cells from corner to corner: how far the neighbouring edge is.
  bool dark_inside = true;
};

/// Each corner, or nothing where an edge cannot be followed: outside the picture, no contrast, covered.
/// `linear` has 256 entries, or none where values are linear.
[[nodiscard]] std::array<std::optional<RefinedCorner>, 4> refine_corners(const GreyPicture& picture,
                                                                         const TagOutline& outline,
                                                                         std::span<const float> linear);

/// The same from where the picture is steepest across each whole edge, at most `reach` px from the straight line
/// between the given corners: no light is fitted. Takes a fiftieth of the time.
[[nodiscard]] std::array<std::optional<RefinedCorner>, 4> locate_corners_by_edge_search(const GreyPicture& picture,
                                                                         const TagOutline& outline,
                                                                         std::span<const float> linear, double reach);

}  // namespace lightwell
