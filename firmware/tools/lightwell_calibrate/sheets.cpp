#include "tools/lightwell_calibrate/sheets.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <lightwell/text.hpp>

#include "tools/command_line.hpp"

namespace lightwell::calibrate {

namespace {

/// Unprintable margin, and space for text and ruler below the board, mm.
constexpr double kEdge = kPrinterMargin_mm, kFooter = 20;

/// Extent of the print beyond the detected corners, relative to the tag's size.
double outside(TagFamily family) {
  const TagShape shape = shape_of(family);
  return (shape.cells - shape.edge_cells) / 2.0 / shape.edge_cells;
}

/// Width and height of the whole print in units of the tag's size.
std::pair<double, double> extent(const TagBoard& board) {
  const double more = 1 + 2 * outside(board.family);
  return {(board.columns - 1) * (1 + board.spacing) + more, (board.rows - 1) * (1 + board.spacing) + more};
}

}  // namespace

std::string brief(double value) { return formatted("%.4g", value); }

std::vector<Rectangle> tag_rectangles(const TagBitmap& tag, double left, double top, double cell) {
  std::vector<Rectangle> out;
  for (int row = 0; row < tag.cells; ++row)
    for (int column = 0; column < tag.cells;) {
      int end = column;
      while (end < tag.cells && tag.is_dark(end, row)) ++end;
      if (end > column) out.push_back({left + column * cell, top + row * cell, (end - column) * cell, cell});
      column = end + 1;
    }
  return out;
}

void draw_ruler(double x, double y, Page& page) {
  constexpr double kThin = 0.15;
  constexpr int kEnd = static_cast<int>(kRulerLength_mm);
  std::vector<Rectangle> lines = {{x, y, kRulerLength_mm, kThin}};
  for (int mm = 0; mm <= kEnd; ++mm) {
    if (mm % 50 == 0)
      page.texts.push_back({std::to_string(mm) + (mm == kEnd ? " mm" : ""), x + mm + 0.8, y - 3.6, 2.4});
    // Millimetre strokes in the first and the last centimetre only.
    if (mm > 10 && mm < kEnd - 10 && mm % 5 != 0) continue;
    const double height = mm % 10 == 0 ? 3.2 : mm % 5 == 0 ? 2.2 : 1.4;
    // The left side of a stroke is at its position; of the last stroke the right side.
    lines.push_back({x + mm - (mm == kEnd ? kThin : 0), y - height, kThin, height});
  }
  page.areas.push_back(black_area(lines));
}

std::vector<Rectangle> digits(int number, double width, double height) {
  // Segments top, upper right, lower right, bottom, lower left, upper left, middle are bits 0 to 6.
  static constexpr std::array<std::uint8_t, 10> kBars = {0x3f, 0x06, 0x5b, 0x4f, 0x66, 0x6d, 0x7d, 0x07, 0x7f, 0x6f};
  const std::string text = std::to_string(number);
  const auto count = static_cast<double>(text.size());
  // A digit is half as wide as high, a gap half as wide as a digit; the underline needs three more bar widths.
  const double high = std::min(height * 9 / 12, width / (0.5 * count + 0.25 * (count - 1)));
  const double wide = high / 2, bar = high / 9, pitch = 1.5 * wide;
  std::vector<Rectangle> out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const double x = (static_cast<double>(i) - (count - 1) / 2) * pitch - wide / 2, y = -high / 2, half = high / 2;
    // Vertical bars end where horizontal ones begin, so that none overlap.
    const double tall = half - 1.5 * bar;
    const std::array<Rectangle, 7> bars = {{{x, y, wide, bar},
                                            {x + wide - bar, y + bar, bar, tall},
                                            {x + wide - bar, y + half + bar / 2, bar, tall},
                                            {x, y + high - bar, wide, bar},
                                            {x, y + half + bar / 2, bar, tall},
                                            {x, y + bar, bar, tall},
                                            {x, y + half - bar / 2, wide, bar}}};
    const std::uint8_t lit = kBars[static_cast<std::size_t>(text[i] - '0')];
    for (std::size_t k = 0; k < bars.size(); ++k)
      if ((lit >> k) & 1) out.push_back(bars[k]);
  }
  const double across = pitch * (count - 1) + wide;
  out.push_back({-across / 2, high / 2 + 2 * bar, across, bar});
  for (Rectangle& r : out) r.y -= 1.5 * bar;
  return out;
}

Result<BoardPage> layout(const TagBoard& board, const Paper& paper) {
  const double tag = 1000 * board.tag_size_m;
  const auto [across, upwards] = extent(board);
  double largest = 0;
  for (const bool turned : {false, true}) {
    const double width = turned ? paper.height_mm : paper.width_mm, height = turned ? paper.width_mm : paper.height_mm;
    const double room_x = width - 2 * kEdge, room_y = height - 2 * kEdge - kFooter;
    largest = std::max(largest, std::min(room_x / across, room_y / upwards));
    if (tag * across > room_x || tag * upwards > room_y) continue;
    BoardPage out;
    out.landscape = turned;
    Page& page = out.page;
    page.width = width;
    page.height = height;
    const double beyond = outside(board.family) * tag;
    out.origin_x_mm = kEdge + (room_x - tag * across) / 2 + beyond;
    out.origin_y_mm = kEdge + (room_y - tag * upwards) / 2 + tag * upwards - beyond;
    const double cell = tag / shape_of(board.family).edge_cells;
    for (int id = board.first_id; id < board.first_id + board.tags(); ++id) {
      const Result<TagBitmap> bitmap = tag_bitmap(board.family, id);
      if (!bitmap) return bitmap.status();
      const Vec3d top_left = board.corners(id)[3];
      page.areas.push_back(black_area(tag_rectangles(*bitmap, out.origin_x_mm + 1000 * top_left.x - beyond,
                                                     out.origin_y_mm - 1000 * top_left.y - beyond, cell)));
    }
    const double foot = height - kEdge - kFooter;
    page.texts.push_back(
        {formatted("Lightwell board: %s, %d x %d tags, numbers %d to %d from the bottom left, tag %.4g mm, "
                   "gap %.4g mm (spacing %.4g).",
                   std::string(to_string(board.family)).c_str(), board.columns, board.rows, board.first_id,
                   board.first_id + board.tags() - 1, tag, tag * board.spacing, board.spacing),
         kEdge + 2, foot + 5, 2.6});
    page.texts.push_back({formatted("Print at 100 %% (\"actual size\") on matt paper and glue it onto something flat. "
                                    "Corner to corner %.4g x %.4g mm: measure both ways.",
                                    1000 * board.width_m(), 1000 * board.height_m()),
                          kEdge + 2, foot + 9, 2.6});
    draw_ruler(kEdge + 2, foot + 18.5, page);
    return out;
  }
  return invalid_argument(
      formatted("the board is %.4g x %.4g mm with its rim and does not fit %s; --tag-size-mm %.4g would, or fewer "
                "--columns and --rows, or larger --paper",
                tag * across, tag * upwards, std::string(paper.name).c_str(), std::floor(largest * 10) / 10));
}

void add_sheet_options(CLI::App& app, SheetOptions& options, const std::vector<std::string>& endings,
                       const std::string& dpi_help, const std::string& output_help, const std::string& json_help) {
  app.add_option("--dpi", options.dpi, dpi_help)->check(number_where("from 36 to 2400", [](double dpi) {
    return dpi >= 36 && dpi <= 2400;
  }));
  const auto check_output = [endings](const std::string& path) {
    if (std::ranges::any_of(endings, [&](const std::string& ending) { return path.ends_with(ending); }))
      return std::string();
    const std::string others = joined(std::span(endings).first(endings.size() - 1));
    return "'" + path + "' must end in " + others + " or " + endings.back();
  };
  app.add_option("--output", options.outputs, output_help)
      ->type_name("FILE")
      ->allow_extra_args(false)
      ->check(check_output);
  app.add_flag("--json", options.json, json_help);
}

Status write_pages(std::span<const Page> pages, const std::string& path, double dpi, std::vector<std::string>& files) {
  if (path.ends_with(".pdf")) {
    files.push_back(path);
    return write_output(path, pages_to_pdf(pages));
  }
  for (std::size_t i = 0; i < pages.size(); ++i) {
    const std::string number = pages.size() == 1 ? "" : "-" + std::to_string(i + 1);
    files.push_back(path.substr(0, path.size() - 4) + number + path.substr(path.size() - 4));
    const Status s = path.ends_with(".png") ? write_page_png(pages[i], dpi, files.back())
                                            : write_output(files.back(), page_to_svg(pages[i]));
    if (!s.ok()) return s;
  }
  return {};
}

}  // namespace lightwell::calibrate
