// A sheet of paper with rectangles, grey areas and words, and the files that it is written to, true to scale.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::calibrate {

/// Millimetres from the top left of the sheet; y grows downwards.
struct Rectangle {
  double x = 0, y = 0, width = 0, height = 0;
};

struct PagePoint {
  double x = 0, y = 0;
};

/// Filled as one shape, so that no hairline shows between outlines that touch. Those that overlap run the same way
/// round.
struct PageArea {
  std::vector<std::vector<PagePoint>> outlines;
  double grey = 0;  ///< sRGB value, 0 black to 1 white.
};

struct PageText {
  std::string text;     ///< ASCII.
  double x = 0, y = 0;  ///< Of the baseline's start.
  double size = 3;      ///< Of the letters' em, mm.
};

struct Page {
  double width = 210, height = 297;
  /// In their order, below all else.
  std::vector<PageArea> areas;
  /// Black. Each inner list is filled as one shape, as a PageArea is. Within one they do not overlap.
  std::vector<std::vector<Rectangle>> shapes;
  std::vector<PageText> texts;
};

/// Vectors; letters are Helvetica, which every reader brings along.
[[nodiscard]] std::string pages_to_pdf(std::span<const Page> pages);
[[nodiscard]] std::string page_to_pdf(const Page& page);
[[nodiscard]] std::string page_to_svg(const Page& page);
/// Pixels are the share of black in their area, of what is grey its share. resource_exhausted: more than 64 megapixels.
[[nodiscard]] Status write_page_png(const Page& page, double dots_per_inch, const std::string& path);

}  // namespace lightwell::calibrate
