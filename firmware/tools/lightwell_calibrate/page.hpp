// A sheet of paper with rectangles, grey areas and texts, written true to scale as PDF, SVG or PNG.
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

/// Outlines filled as one shape, so that no gap shows between touching ones. Overlapping outlines have the same
/// orientation.
struct PageArea {
  std::vector<std::vector<PagePoint>> outlines;
  double grey = 0;  ///< sRGB value, 0 black to 1 white.
};

struct PageText {
  std::string text;     ///< ASCII.
  double x = 0, y = 0;  ///< Start of the baseline.
  double size = 3;      ///< Font size (em), mm.
};

struct Page {
  double width = 210, height = 297;
  /// Drawn first, in this order.
  std::vector<PageArea> areas;
  /// Black rectangles. Each inner list is filled as one shape, like a PageArea; its rectangles do not overlap.
  std::vector<std::vector<Rectangle>> shapes;
  std::vector<PageText> texts;
};

/// Vector graphics; texts in Helvetica, one of PDF's standard fonts. The document asks viewers to print without scaling
/// (ISO 32000-1, 12.2, PrintScaling), which cairo's PDF surface cannot express.
[[nodiscard]] std::string pages_to_pdf(std::span<const Page> pages);
[[nodiscard]] std::string page_to_pdf(const Page& page);
[[nodiscard]] std::string page_to_svg(const Page& page);
/// Pixel values are exact area averages. resource_exhausted: more than 64 megapixels.
[[nodiscard]] Status write_page_png(const Page& page, double dots_per_inch, const std::string& path);

}  // namespace lightwell::calibrate
