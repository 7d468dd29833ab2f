// A board of tags on a sheet of paper: which way round it fits, where it lies, and the words and the ruler below it.
#pragma once

#include <lightwell/result.hpp>

#include "pose/tag_board.hpp"
#include "tools/lightwell_calibrate/page.hpp"
#include "tools/lightwell_calibrate/sheet_parts.hpp"

namespace lightwell::calibrate {

struct BoardPage {
  Page page;
  bool landscape = false;
  /// The bottom left corner of the first tag, the board's origin, on the sheet.
  double origin_x_mm = 0, origin_y_mm = 0;
};

/// `board` validates. The sheet is upright where the board fits that way, else turned. invalid_argument where it fits
/// neither way, with the largest tag that would.
[[nodiscard]] Result<BoardPage> layout(const TagBoard& board, const Paper& paper);

}  // namespace lightwell::calibrate
