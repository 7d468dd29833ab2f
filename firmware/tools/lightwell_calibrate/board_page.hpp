// Layout of a board of tags on a sheet of paper: orientation, position, and the text and ruler below it.
#pragma once

#include <lightwell/result.hpp>

#include "pose/tag_board.hpp"
#include "tools/lightwell_calibrate/page.hpp"
#include "tools/lightwell_calibrate/sheet_parts.hpp"

namespace lightwell::calibrate {

struct BoardPage {
  Page page;
  bool landscape = false;
  /// Position of the board's origin (bottom left corner of the first tag) on the sheet.
  double origin_x_mm = 0, origin_y_mm = 0;
};

/// `board` has passed validate(). Portrait if the board fits that way, otherwise landscape. invalid_argument: it fits
/// neither way; the message gives the largest tag that would.
[[nodiscard]] Result<BoardPage> layout(const TagBoard& board, const Paper& paper);

}  // namespace lightwell::calibrate
