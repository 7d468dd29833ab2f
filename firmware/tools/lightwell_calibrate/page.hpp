// A sheet of paper with rectangles, lines and words, and the files that it is written to, true to scale.
#pragma once

#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::calibrate {

/// Millimetres from the top left of the sheet; y grows downwards.
struct Rectangle {
  double x = 0, y = 0, width = 0, height = 0;
};

struct PageText {
  std::string text;     ///< ASCII.
  double x = 0, y = 0;  ///< Of the baseline's start.
  double size = 3;      ///< Of the letters' em, mm.
};

/// All black on white.
struct Page {
  double width = 210, height = 297;
  /// Each inner list is filled as one shape, so that no hairline shows between rectangles that touch. Within one they
  /// do not overlap.
  std::vector<std::vector<Rectangle>> shapes;
  std::vector<PageText> texts;
};

/// One page of vectors; letters are Helvetica, which every reader brings along.
[[nodiscard]] std::string page_to_pdf(const Page& page);
[[nodiscard]] std::string page_to_svg(const Page& page);
/// Pixels are the share of black in their area. resource_exhausted: more than 64 megapixels.
[[nodiscard]] Status write_page_png(const Page& page, double dots_per_inch, const std::string& path);

}  // namespace lightwell::calibrate
