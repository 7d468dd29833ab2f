// Printed sheets: a page of rectangles, grey areas and texts, written true to scale as PDF, SVG or PNG; tags, a ruler,
// numbers and a board on it.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include <lightwell/result.hpp>

#include "pose/tag_board.hpp"

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

struct Paper {
  std::string_view name;
  double width_mm = 0, height_mm = 0;  ///< In portrait orientation.
};

inline constexpr std::array<Paper, 3> kPapers = {{{"a4", 210, 297}, {"a3", 297, 420}, {"letter", 215.9, 279.4}}};

inline std::string_view to_string(const Paper& paper) { return paper.name; }

/// Unprintable margin, and the length of the ruler.
inline constexpr double kPrinterMargin_mm = 7, kRulerLength_mm = 100;

/// Formats a number with four significant digits.
[[nodiscard]] std::string brief(double value);

/// The dark cells of an upright tag, adjacent cells of a row merged; the top left cell is at (left, top), mm.
[[nodiscard]] std::vector<Rectangle> tag_rectangles(const TagBitmap& tag, double left, double top, double cell);

/// Draws a ruler of kRulerLength_mm between the outer sides of its first and last stroke, above the line at y.
void draw_ruler(double x, double y, Page& page);

/// A number in seven-segment digits, centred at the origin, underlined, within `width` and `height`; y downwards.
[[nodiscard]] std::vector<Rectangle> digits(int number, double width, double height);

struct BoardPage {
  Page page;
  bool landscape = false;
  /// Position of the board's origin (bottom left corner of the first tag) on the sheet.
  double origin_x_mm = 0, origin_y_mm = 0;
};

/// `board` is valid. Portrait if it fits that way, else landscape. invalid_argument: the largest tag that would fit.
[[nodiscard]] Result<BoardPage> layout(const TagBoard& board, const Paper& paper);

struct SheetOptions {
  Paper paper = kPapers[0];
  double dpi = 300;
  std::vector<std::string> outputs;
  bool json = false;
};

/// Adds --dpi, --output and --json. `endings`: of the output files.
void add_sheet_options(CLI::App& app, SheetOptions& options, const std::vector<std::string>& endings,
                       const std::string& dpi_help, const std::string& output_help, const std::string& json_help);

/// Writes the pages as a .pdf, or as an .svg or .png of each: "sheet-2.svg" for page 2. Adds their names to `files`.
[[nodiscard]] Status write_pages(std::span<const Page> pages, const std::string& path, double dpi,
                                 std::vector<std::string>& files);

}  // namespace lightwell::calibrate
