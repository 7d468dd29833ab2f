// A board of tags on a sheet of paper: which way round it fits, where it lies, and the words and the ruler below it.
#pragma once

#include <array>
#include <string_view>

#include <lightwell/result.hpp>

#include "pose/tag_board.hpp"
#include "tools/lightwell_calibrate/page.hpp"

namespace lightwell::calibrate {

struct Paper {
  std::string_view name;
  double width_mm = 0, height_mm = 0;  ///< Upright.
};

inline constexpr std::array<Paper, 3> kPapers = {{{"a4", 210, 297}, {"a3", 297, 420}, {"letter", 215.9, 279.4}}};

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
