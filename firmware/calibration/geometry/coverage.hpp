// Which part of a lens's picture boards have not been shown in yet, while pictures are being taken.
#pragma once

#include <string>
#include <vector>

#include "calibration/geometry/board_observations.hpp"

namespace lightwell::calibration {

/// The picture in cells, and in how many pictures a point was seen in each.
struct Coverage {
  /// A lens is known where so many pictures show a point.
  static constexpr int kEnough = 3;

  int columns = 0, rows = 0;
  std::vector<int> pictures;  ///< By cell, rows from the top.
  std::vector<bool> counts;   ///< By cell: whether the lens sees anything there.
  int with_board = 0;         ///< Pictures that show a board at all.

  [[nodiscard]] bool needs_views(int column, int row) const {
    const auto at = static_cast<std::size_t>(row * columns + column);
    return counts[at] && pictures[at] < kEnough;
  }
  /// Of the cells that count, the share that is known.
  [[nodiscard]] double share() const;
};

/// About 12 cells across the longer side. `circle_px`: radius of the picture's circle about its middle, outside of
/// which nothing is asked for; 0: the whole picture.
[[nodiscard]] Coverage coverage(const BoardObservations& observations, int lens, double circle_px);

/// What to do next, in words, nearest need first: "show the board in the upper left of the picture, towards its edge".
/// Empty where enough was seen.
[[nodiscard]] std::vector<std::string> suggest_views(const Coverage& coverage);

}  // namespace lightwell::calibration
