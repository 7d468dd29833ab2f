// Input of the geometric calibration: observations of known points on flat boards, their coverage of the picture; and
// the deviation of a printed board from its description, estimated together with the lens as by Strobl & Hirzinger 2011
// ("More accurate pinhole camera calibration with imperfect planar target"), but with a few parameters per board.
#pragma once

#include <array>
#include <numbers>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/model/camera_model.hpp"

namespace lightwell::calibration {

/// A flat board: points in the board frame, m, all with z = 0.
struct Board {
  std::string name;
  std::vector<Vec3d> points;
  /// Consecutive points that belong to one tag, whose size is assumed to be exact, its position not; 0: unknown.
  int points_per_tag = 0;
};

/// Observation of one board point in a picture.
struct PointObservation {
  int board = 0;  ///< Index into BoardObservations::boards.
  int point = 0;  ///< Index into that board's points.
  PixelPosition pixel;
};

/// A picture of one lens.
struct Picture {
  std::string name;  ///< Used in messages.
  int lens = 0;
  /// Pictures with the same capture index share the rig's pose, except for the lenses' time offset.
  int capture = 0;
  double time_s = 0;  ///< Of the capture; used to estimate the time offset.
  std::vector<PointObservation> observations;
};

struct LensSize {
  int width = 0, height = 0;
};

/// A lens of this model without a limit of its field of view.
[[nodiscard]] inline LensParameters lens_of(const LensSize& size, const ModelParameters& model) {
  return {size.width, size.height, model, std::numbers::pi, {}, {}};
}

struct BoardObservations {
  std::vector<LensSize> lenses;  ///< One or two.
  std::vector<Board> boards;
  std::vector<Picture> pictures;
};

/// Parameters, in the order of the bundle adjustment:
///   0       relative change of the distance between tag centres (tags keep their size);
///   1       relative excess of the scale along x over the scale along y;
///   2 to 13 height of the surface, m: coefficients of u², uv, v², u³ ... v⁴, where u and v are the position relative
///           to the board's centre, in units of half its longer side.
/// Constant and linear terms are part of the board's pose.
struct BoardShape {
  static constexpr std::size_t kParameters = 14, kFirstHeight = 2;
  std::array<double, kParameters> numbers{};

  [[nodiscard]] double spacing_change() const { return numbers[0]; }
};

/// Derivatives of one point's position with respect to the parameters of BoardShape; they are constant.
struct ShapeBasis {
  std::array<Vec3d, BoardShape::kParameters> per_number{};

  template <class T>
  void deform(const T* numbers, T& x, T& y, T& z) const {
    for (std::size_t k = 0; k < per_number.size(); ++k) {
      x += numbers[k] * per_number[k].x;
      y += numbers[k] * per_number[k].y;
      z += numbers[k] * per_number[k].z;
    }
  }
};

/// One basis per point of the board.
[[nodiscard]] std::vector<ShapeBasis> shape_basis(const Board& board);
/// Prior standard deviation of each parameter: tolerances of printing and of gluing by hand.
[[nodiscard]] std::array<double, BoardShape::kParameters> shape_prior(const Board& board);
/// Flatness deviation: largest less smallest height above the best-fit plane, m.
[[nodiscard]] double flatness(const Board& board, const BoardShape& shape);

/// Coverage of a lens's picture: a grid of cells, with the number of pictures that have an observation in each.
struct Coverage {
  /// Number of pictures with an observation for which a cell counts as covered.
  static constexpr int kMinViewsPerCell = 3;

  int columns = 0, rows = 0;
  std::vector<int> pictures;  ///< By cell, rows from the top.
  std::vector<bool> counts;   ///< By cell: whether it is inside the image circle.
  int with_board = 0;         ///< Number of pictures with at least one observation.

  [[nodiscard]] bool needs_views(int column, int row) const {
    const auto at = static_cast<std::size_t>(row * columns + column);
    return counts[at] && pictures[at] < kMinViewsPerCell;
  }
  /// Covered fraction of the cells that count.
  [[nodiscard]] double share() const;
};

/// About 12 cells along the longer side. `circle_px`: radius of the image circle; cells outside do not count. 0: all.
[[nodiscard]] Coverage coverage(const BoardObservations& observations, int lens, double circle_px);

/// Instructions for the next pictures, the most important first. Empty if the coverage suffices.
[[nodiscard]] std::vector<std::string> suggest_views(const Coverage& coverage);

}  // namespace lightwell::calibration
