#include "pose/tag_board.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <type_traits>

#include <apriltag/apriltag.h>
#include <apriltag/common/image_u8.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>

#include <lightwell/files.hpp>
#include <lightwell/text.hpp>

#include "imaging/uri.hpp"

namespace lightwell {

namespace {

/// Larger values are taken for typing errors.
constexpr int kMaxTagsPerSide = 100;
constexpr double kMaxTagSize_m = 10;
constexpr double kMaxSpacing = 100;

std::string to_text(double value) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  return {digits, end};
}

/// The spacing at which neighbouring tags touch; tags with a white rim may share one rim of one cell.
double min_spacing(TagFamily family) {
  const TagShape shape = shape_of(family);
  const double outside = (shape.cells - shape.edge_cells) / 2.0;
  return (shape.dark_inside ? 1.0 : 2 * outside) / shape.edge_cells;
}

/// The value of a YAML scalar without its quotes, single or double, and without a comment.
std::string_view scalar(std::string_view text) {
  text = trimmed(text);
  if (!text.empty() && (text[0] == '\'' || text[0] == '"')) {
    const auto end = text.find(text[0], 1);
    return end == std::string_view::npos ? text : text.substr(1, end - 1);
  }
  // YAML: '#' starts a comment at the beginning or after white space.
  for (std::size_t i = 0; i < text.size(); ++i)
    if (text[i] == '#' && (i == 0 || text[i - 1] == ' ' || text[i - 1] == '\t')) return trimmed(text.substr(0, i));
  return text;
}

const std::vector<std::string_view> kNames = {"target_type", "tagCols",    "tagRows",  "tagSize",
                                              "tagSpacing",  "codeOffset", "tagFamily"};

/// Sets the field of this name, one of kNames; returns a message if the value is invalid, otherwise an empty one.
std::string set(TagBoard& board, std::string_view name, std::string_view value) {
  const std::string quoted = "'" + std::string(value) + "'";
  const auto number = [&](auto& field) -> std::string {
    using Number = std::remove_reference_t<decltype(field)>;
    // YAML allows a plus sign.
    const auto parsed = parse_number<Number>(value.substr(value.starts_with('+') ? 1 : 0));
    if (!parsed) return quoted + (std::is_integral_v<Number> ? " is not a whole number" : " is not a number");
    field = *parsed;
    return {};
  };
  if (name == "tagCols") return number(board.columns);
  if (name == "tagRows") return number(board.rows);
  if (name == "tagSize") return number(board.tag_size_m);
  if (name == "tagSpacing") return number(board.spacing);
  if (name == "codeOffset") return number(board.first_id);
  if (name == "tagFamily") {
    const Result<TagFamily> family = parse_tag_family(value);
    if (family) board.family = *family;
    return family.status().message();
  }
  return value == "aprilgrid" ? "" : quoted + " is not supported; a board of tags is of type 'aprilgrid'";
}

}  // namespace

std::string_view to_string(TagFamily family) { return family == TagFamily::tag36h11 ? "tag36h11" : "tagStandard41h12"; }

Result<TagFamily> parse_tag_family(std::string_view name) {
  for (const TagFamily family : {TagFamily::tag36h11, TagFamily::tagStandard41h12})
    if (name == to_string(family)) return family;
  return invalid_argument("'" + std::string(name) +
                          "' is not a family of tags; known are tag36h11 and tagStandard41h12");
}

TagShape shape_of(TagFamily family) {
  if (family == TagFamily::tag36h11) return {10, 8, 587, true};
  return {9, 5, 2115, false};
}

ApriltagFamily make_apriltag_family(TagFamily family) {
  if (family == TagFamily::tagStandard41h12) return {tagStandard41h12_create(), tagStandard41h12_destroy};
  return {tag36h11_create(), tag36h11_destroy};
}

Result<TagBitmap> tag_bitmap(TagFamily family, int id) {
  const TagShape shape = shape_of(family);
  if (id < 0 || id >= shape.tags)
    return invalid_argument(std::string(to_string(family)) + " has no tag " + std::to_string(id) + "; its last is " +
                            std::to_string(shape.tags - 1));
  const ApriltagFamily held = make_apriltag_family(family);
  const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> image(apriltag_to_image(held.get(), id), image_u8_destroy);
  TagBitmap out;
  out.cells = image->width;
  for (int y = 0; y < image->height; ++y)
    for (int x = 0; x < image->width; ++x) out.dark.push_back(image->buf[y * image->stride + x] < 128);
  return out;
}

Status TagBoard::validate() const {
  if (columns < 1 || columns > kMaxTagsPerSide)
    return invalid_argument(formatted("columns (tagCols) is %d; it must be 1 to %d", columns, kMaxTagsPerSide));
  if (rows < 1 || rows > kMaxTagsPerSide)
    return invalid_argument(formatted("rows (tagRows) is %d; it must be 1 to %d", rows, kMaxTagsPerSide));
  if (!(tag_size_m > 0 && tag_size_m <= kMaxTagSize_m))
    return invalid_argument("tag_size_m (tagSize) is " + to_text(tag_size_m) +
                            "; it is in metres, above 0 and at most " + to_text(kMaxTagSize_m));
  const double least = min_spacing(family);
  // Tolerates a spacing that the user rounded to three digits.
  if (!(spacing >= least - 1e-3 && spacing <= kMaxSpacing))
    return invalid_argument("spacing (tagSpacing) is " + to_text(spacing) + "; tags of " +
                            std::string(to_string(family)) + " need at least " + to_text(least) +
                            " of their size between them, and at most " + to_text(kMaxSpacing));
  const int known = shape_of(family).tags;
  if (first_id < 0 || first_id > known - tags())
    return invalid_argument(formatted("first_id (codeOffset) is %d and the board has %d tags; ", first_id, tags()) +
                            std::string(to_string(family)) + " has numbers 0 to " + std::to_string(known - 1));
  return {};
}

Vec3d TagBoard::center(int id) const {
  const int index = id - first_id;
  const int column = index % columns, row = index / columns;
  return {column * pitch_m() + tag_size_m / 2, row * pitch_m() + tag_size_m / 2, 0};
}

std::array<Vec3d, 4> TagBoard::corners(int id) const {
  std::array<Vec3d, 4> out = tag_corners(tag_size_m);
  const Vec3d middle = center(id);
  for (Vec3d& corner : out) corner += middle;
  return out;
}

std::array<Vec3d, 4> tag_corners(double tag_size_m) {
  const double h = tag_size_m / 2;
  return {Vec3d{-h, -h, 0}, Vec3d{h, -h, 0}, Vec3d{h, h, 0}, Vec3d{-h, h, 0}};
}

Result<TagBoard> parse_tag_board(std::string_view text, const std::string& name) {
  TagBoard board;
  std::map<std::string_view, int> line_of;
  int line_number = 0;
  const auto wrong = [&](const std::string& what) {
    return invalid_argument(name + ":" + std::to_string(line_number) + ": " + what);
  };
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    ++line_number;
    if (line.empty() || line[0] == '#' || line == "---" || line.starts_with("%YAML")) continue;
    const auto colon = line.find(':');
    if (colon == std::string_view::npos) return wrong("'" + std::string(line) + "' is not 'name: value'");
    const std::string_view key = scalar(line.substr(0, colon)), value = scalar(line.substr(colon + 1));
    if (std::ranges::find(kNames, key) == kNames.end()) {
      const std::string near = nearest_name(key, kNames);
      return wrong("unknown field '" + std::string(key) + "'" + (near.empty() ? "" : "; did you mean '" + near + "'?"));
    }
    const auto [first, is_new] = line_of.emplace(key, line_number);
    if (!is_new)
      return wrong(std::string(key) + " is given twice; the first is on line " + std::to_string(first->second));
    if (const std::string problem = set(board, key, value); !problem.empty())
      return wrong(std::string(key) + ": " + problem);
  }
  for (const char* needed : {"target_type", "tagCols", "tagRows", "tagSize", "tagSpacing"})
    if (!line_of.contains(needed)) return invalid_argument(name + ": " + needed + " is missing");
  if (const Status s = board.validate(); !s.ok()) return Status(s.code(), name + ": " + s.message());
  return board;
}

Result<TagBoard> load_tag_board(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  return parse_tag_board(*text, path);
}

std::string tag_board_to_text(const TagBoard& board) {
  std::string out = "target_type: 'aprilgrid'\n";
  out += "tagFamily: '" + std::string(to_string(board.family)) + "'\n";
  out += "tagCols: " + std::to_string(board.columns) + "\n";
  out += "tagRows: " + std::to_string(board.rows) + "\n";
  out += "tagSize: " + to_text(board.tag_size_m) + "  # m, between the corners that are detected\n";
  out += "tagSpacing: " + to_text(board.spacing) + "  # gap / tagSize\n";
  out += "codeOffset: " + std::to_string(board.first_id) + "  # number of the bottom left tag\n";
  return out;
}

}  // namespace lightwell
