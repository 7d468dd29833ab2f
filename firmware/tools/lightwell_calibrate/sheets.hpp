// Printed sheets: paper sizes, tags, a ruler, numbers, a board, output.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include <lightwell/result.hpp>

#include "pose/tag_board.hpp"
#include "tools/lightwell_calibrate/page.hpp"

namespace lightwell::calibrate {

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
