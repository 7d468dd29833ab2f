// What every sheet to print has: paper, tags, a ruler, numbers.
//   Paper, kPapers, find_paper   sheets of paper
//   kSheetEdge                   what printers leave white
//   tag_rectangles               a tag's dark cells
//   draw_ruler                   100 mm, to tell a printer's scale
//   digits                       a number as filled bars, in any direction
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

#include "pose/tag_family.hpp"
#include "tools/lightwell_calibrate/page.hpp"

namespace lightwell::calibrate {

struct Paper {
  std::string_view name;
  double width_mm = 0, height_mm = 0;  ///< Upright.
};

inline constexpr std::array<Paper, 3> kPapers = {{{"a4", 210, 297}, {"a3", 297, 420}, {"letter", 215.9, 279.4}}};

/// invalid_argument names those that are known.
[[nodiscard]] Result<Paper> find_paper(std::string_view name);

/// mm.
inline constexpr double kSheetEdge = 7, kRuler = 100;

/// Four digits.
[[nodiscard]] std::string brief(double value);

/// The dark cells of an upright tag, runs of a row in one; all cells of the tag begin at left, top.
[[nodiscard]] std::vector<Rectangle> tag_rectangles(const TagBitmap& tag, double left, double top, double cell);

/// kRuler mm from the outside of the first stroke to that of the last; strokes and words stand above the line through
/// y.
void draw_ruler(double x, double y, Page& page);

/// A number in bars as on a pocket calculator, around the origin, underlined: upside down a 6 is a 9. y grows
/// downwards. `width` and `height` are the most that it takes.
[[nodiscard]] std::vector<Rectangle> digits(int number, double width, double height);

}  // namespace lightwell::calibrate
