// Coverage of a lens's picture by board observations while pictures are being taken.
#pragma once

#include <string>
#include <vector>

#include "calibration/solve/geometry/board_observations.hpp"

namespace lightwell::calibration {

/// A grid of cells over the picture, with the number of pictures that have an observation in each cell.
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

/// About 12 cells along the longer side. `circle_px`: radius of the image circle about the picture's centre; cells
/// outside do not count. 0: the whole picture.
[[nodiscard]] Coverage coverage(const BoardObservations& observations, int lens, double circle_px);

/// Instructions for the next pictures, the most important first: "show the board in the upper left of the picture,
/// towards its edge". Empty if the coverage suffices.
[[nodiscard]] std::vector<std::string> suggest_views(const Coverage& coverage);

}  // namespace lightwell::calibration
