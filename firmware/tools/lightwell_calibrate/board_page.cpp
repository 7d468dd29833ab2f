#include "tools/lightwell_calibrate/board_page.hpp"

#include <algorithm>
#include <cmath>
#include <string>

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
      page.shapes.push_back(tag_rectangles(*bitmap, out.origin_x_mm + 1000 * top_left.x - beyond,
                                           out.origin_y_mm - 1000 * top_left.y - beyond, cell));
    }
    const double foot = height - kEdge - kFooter;
    const std::string numbers =
        std::to_string(board.first_id) + " to " + std::to_string(board.first_id + board.tags() - 1);
    page.texts.push_back({"Lightwell board: " + std::string(to_string(board.family)) + ", " +
                              std::to_string(board.columns) + " x " + std::to_string(board.rows) + " tags, numbers " +
                              numbers + " from the bottom left, tag " + brief(tag) + " mm, gap " +
                              brief(tag * board.spacing) + " mm (spacing " + brief(board.spacing) + ").",
                          kEdge + 2, foot + 5, 2.6});
    page.texts.push_back(
        {"Print at 100 % (\"actual size\") on matt paper and glue it onto something flat. Corner to corner " +
             brief(1000 * board.width_m()) + " x " + brief(1000 * board.height_m()) + " mm: measure both ways.",
         kEdge + 2, foot + 9, 2.6});
    draw_ruler(kEdge + 2, foot + 18.5, page);
    return out;
  }
  return Status(StatusCode::invalid_argument, "the board is " + brief(tag * across) + " x " + brief(tag * upwards) +
                                                  " mm with its rim and does not fit " + std::string(paper.name) +
                                                  "; --tag-size-mm " + brief(std::floor(largest * 10) / 10) +
                                                  " would, or fewer --columns and --rows, or larger --paper");
}

}  // namespace lightwell::calibrate
