// Parts common to all printed sheets: paper sizes, tags, a ruler, numbers.
//   Paper, kPapers, find_paper   sheets of paper
//   kPrinterMargin_mm            unprintable margin
//   tag_rectangles               the dark cells of a tag
//   draw_ruler                   a ruler of 100 mm, to measure the printer's scale
//   digits                       a number as filled bars, readable in any orientation
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
  double width_mm = 0, height_mm = 0;  ///< In portrait orientation.
};

inline constexpr std::array<Paper, 3> kPapers = {{{"a4", 210, 297}, {"a3", 297, 420}, {"letter", 215.9, 279.4}}};

/// invalid_argument: an unknown name; the message lists the known ones.
[[nodiscard]] Result<Paper> find_paper(std::string_view name);

inline constexpr double kPrinterMargin_mm = 7, kRulerLength_mm = 100;

/// Formats a number with four significant digits.
[[nodiscard]] std::string brief(double value);

/// The dark cells of an upright tag, adjacent cells of a row merged; the top left cell is at (left, top), mm.
[[nodiscard]] std::vector<Rectangle> tag_rectangles(const TagBitmap& tag, double left, double top, double cell);

/// Draws a ruler of kRulerLength_mm, measured between the outer sides of its first and last stroke. Strokes and text
/// are above the line at y.
void draw_ruler(double x, double y, Page& page);

/// A number in seven-segment digits, centred at the origin, underlined to distinguish 6 and 9. y increases downwards.
/// `width` and `height` are its maximum dimensions.
[[nodiscard]] std::vector<Rectangle> digits(int number, double width, double height);

}  // namespace lightwell::calibrate
