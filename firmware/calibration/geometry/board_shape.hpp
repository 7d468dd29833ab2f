// How a printed board differs from what its file says: another spacing of its tags, another scale across than along,
// and a surface that is bent. A plane is calibrated with for as long as the sightings do not contradict it; beyond, the
// shape is fitted together with the lens, as Strobl & Hirzinger 2011 ("More accurate pinhole camera calibration with
// imperfect planar target") do, here with a few numbers for the whole board in place of three for each point.
#pragma once

#include <array>
#include <vector>

#include "calibration/geometry/board_observations.hpp"

namespace lightwell::calibration {

/// In the order in which the bundle fits them:
///   0       how much further apart the centres of tags are, relative (tags keep their size);
///   1       how much longer the board is along x than along y, relative;
///   2 to 13 the surface's height, m: coefficients of u², uv, v², u³ ... v⁴, where u and v are the place from the
///           board's middle in half its longer side.
/// Constant and linear terms are the board's pose.
struct BoardShape {
  static constexpr std::size_t kParameters = 14, kFirstHeight = 2;
  std::array<double, kParameters> numbers{};

  [[nodiscard]] double spacing_change() const { return numbers[0]; }
};

/// What each number of a shape does to one point: derivatives of its place, which are constant.
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

/// By point of the board.
[[nodiscard]] std::vector<ShapeBasis> shape_basis(const Board& board);
/// Standard deviation of each number before anything is seen: what a printer and a hand with glue may do.
[[nodiscard]] std::array<double, BoardShape::kParameters> shape_prior(const Board& board);
/// The largest height above the best plane less the smallest, m.
[[nodiscard]] double flatness(const Board& board, const BoardShape& shape);

}  // namespace lightwell::calibration
