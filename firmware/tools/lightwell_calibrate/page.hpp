// A sheet of paper with rectangles, grey areas and texts, written true to scale as PDF, SVG or PNG.
#pragma once

#include <cstddef>
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

/// Outlines filled as one shape, without gaps between touching ones. Overlapping ones have the same orientation.
struct PageArea {
  std::vector<std::vector<PagePoint>> outlines;
  double grey = 0;  ///< sRGB value, 0 black to 1 white.
};

/// Rectangles that do not overlap, as one black shape.
[[nodiscard]] PageArea black_area(std::span<const Rectangle> rectangles);

struct PageText {
  std::string text;     ///< ASCII.
  double x = 0, y = 0;  ///< Start of the baseline.
  double size = 3;      ///< Font size (em), mm.
};

struct Page {
  double width = 210, height = 297;
  std::vector<PageArea> areas;  ///< Drawn in this order.
  std::vector<PageText> texts;
};

/// Coverage of the pixels in the bounding box of the outlines; all others are not covered.
struct Coverage {
  int left = 0, top = 0;  ///< Position of the box on the page, px.
  int width = 0, height = 0;
  std::vector<float> share;  ///< Row by row, 0 to 1.

  [[nodiscard]] float at(int x, int y) const { return share[static_cast<std::size_t>(y * width + x)]; }
};

/// The exact share of each pixel that the outlines cover, for pages that are true to scale to a fraction of a pixel.
/// `outlines` in mm, `scale` in pixels per mm. Overlapping ones have the same orientation and at most 1.
[[nodiscard]] Coverage coverage_of(const std::vector<std::vector<PagePoint>>& outlines, double scale);

/// Vector graphics; texts in Helvetica, one of PDF's standard fonts. The document asks viewers to print without scaling
/// (ISO 32000-1, 12.2, PrintScaling), which cairo's PDF surface cannot express.
[[nodiscard]] std::string pages_to_pdf(std::span<const Page> pages);
[[nodiscard]] std::string page_to_svg(const Page& page);
/// Pixel values are exact area averages. resource_exhausted: more than 64 megapixels.
[[nodiscard]] Status write_page_png(const Page& page, double dots_per_inch, const std::string& path);

}  // namespace lightwell::calibrate
