// Subpixel corners of a tag, from the intensities on both sides of its edges.
//
// Along each of the two edges that meet in a corner, a model of a blurred edge is fitted to the pixels:
//   I(p) = inside + (outside - inside) S(d(p))
// d(p) is the distance from a parabola, which approximates a straight edge seen through a fisheye lens over a few dozen
// pixels. S is a step convolved with a Gaussian, whose width is fitted too, and with the area of a square pixel.
// The corner is the intersection of both curves. Pixels close to the corner are not used, because blur rounds it.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "calibration/model/camera_model.hpp"
#include "pose/grey_view.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {

struct RefinedCorner {
  PixelPosition position;
  PixelCovariance covariance;
};

/// nullopt for a corner with an edge that cannot be traced: outside the picture, without contrast, or occluded.
struct RefinedTag {
  std::array<std::optional<RefinedCorner>, 4> corners;
  /// Standard deviation of the blur across the tag's edges (edge_blur.hpp), px: the mean of two opposite edges, of the
  /// pair that is blurred more (motion along the other pair does not blur it). nullopt: measured on no edge.
  std::optional<double> blur_px;
};

/// The detected outline of a tag, from which the refinement starts.
struct TagOutline {
  std::array<PixelPosition, 4> corners{};  ///< In order around the tag; accurate to a few pixels.
  int edge_cells = 8;                      ///< Cells from corner to corner.
  bool dark_inside = true;
};

/// Fits the edge model. `linear` has 256 entries (linear intensity of each pixel value, 0 to 1), or none if values are
/// linear.
[[nodiscard]] RefinedTag refine_corners(const GreyPicture& picture, const TagOutline& outline,
                                        std::span<const float> linear);

/// Intersects parabolas through the points of steepest gradient along each whole edge, at most `reach` px from the
/// straight line between the given corners, without fitting intensities. Takes a fiftieth of the time.
[[nodiscard]] RefinedTag locate_corners_by_edge_search(const GreyPicture& picture, const TagOutline& outline,
                                                       std::span<const float> linear, double reach);

}  // namespace lightwell
