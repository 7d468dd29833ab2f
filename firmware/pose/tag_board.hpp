// AprilTag families, the printed pattern of their tags, a planar grid of tags as a value, and Kalibr's YAML for targets
// of type 'aprilgrid'.
//
// Board frame: right-handed, metres; z = 0 is the paper, +Z points from it towards the viewer, +X right, +Y up. That is
// Kalibr's convention and agrees with the axes of the world frame for an upright board. The origin is the bottom left
// corner of the first tag. Ids increase to the right and then upwards, row by row from the bottom.
//
//      6   7   8
//      3   4   5        y
//      0   1   2        |
//     ^                 +-- x
//     origin
//
// Corners of a tag, in the order of AprilTag and Kalibr:
//   0 bottom left, 1 bottom right, 2 top right, 3 top left, of the upright tag seen from its printed face.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

struct apriltag_family;  // Of the AprilTag library.

namespace lightwell {

enum class TagFamily : std::uint8_t {
  tag36h11,          ///< 587 tags, black border outside; the most common family.
  tagStandard41h12,  ///< 2,115 tags; data bits outside the border, so that cells are larger on the same paper.
};

[[nodiscard]] std::string_view to_string(TagFamily family);

/// Parses AprilTag's name of a family. invalid_argument: an unknown name; the message lists the known ones.
[[nodiscard]] Result<TagFamily> parse_tag_family(std::string_view name);

struct TagShape {
  int cells = 0;            ///< Width of the whole tag in cells, including the white rim if the family has one.
  int edge_cells = 0;       ///< Width in cells of the square whose corners are detected, which defines the tag's size.
  int tags = 0;             ///< Number of tags; ids are 0 to tags - 1.
  bool dark_inside = true;  ///< Whether that square is dark along its edge and its surroundings bright, or vice versa.
};

[[nodiscard]] TagShape shape_of(TagFamily family);

/// The cells of an upright tag, seen from its printed face.
struct TagBitmap {
  int cells = 0;
  std::vector<bool> dark;  ///< Row by row from the top, `cells` per row.

  [[nodiscard]] bool is_dark(int column, int row) const { return dark[static_cast<std::size_t>(row * cells + column)]; }
};

/// The AprilTag library's table of a family.
using ApriltagFamily = std::unique_ptr<apriltag_family, void (*)(apriltag_family*)>;
[[nodiscard]] ApriltagFamily make_apriltag_family(TagFamily family);

/// invalid_argument: an id that the family does not have.
[[nodiscard]] Result<TagBitmap> tag_bitmap(TagFamily family, int id);

struct TagBoard {
  TagFamily family = TagFamily::tag36h11;
  int columns = 6, rows = 6;
  /// Distance between the detected corners, m: of tag36h11 the black frame's outside, of tagStandard41h12 its inside.
  double tag_size_m = 0.024;
  /// Gap between the squares of neighbouring tags divided by tag_size_m (Kalibr's tagSpacing).
  double spacing = 0.3;
  int first_id = 0;  ///< Kalibr's codeOffset.

  /// invalid_argument: no tags, sizes that are not positive and finite, overlapping tags, ids that the family does not
  /// have. The message names the field and the remedy.
  [[nodiscard]] Status validate() const;

  // The functions below require a board that passes validate().
  [[nodiscard]] int tags() const { return columns * rows; }
  [[nodiscard]] double pitch_m() const { return tag_size_m * (1 + spacing); }
  /// From the left edge of the first column to the right edge of the last one; the height likewise.
  [[nodiscard]] double width_m() const { return (columns - 1) * pitch_m() + tag_size_m; }
  [[nodiscard]] double height_m() const { return (rows - 1) * pitch_m() + tag_size_m; }
  [[nodiscard]] bool holds(TagFamily of, int id) const {
    return of == family && id >= first_id && id < first_id + tags();
  }
  /// The four corners of a tag of the board, board frame, m.
  [[nodiscard]] std::array<Vec3d, 4> corners(int id) const;
  /// The centre of a tag of the board, board frame, m.
  [[nodiscard]] Vec3d center(int id) const;
};

/// The corners of a tag in its own frame, m: axes as of a board, origin in the tag's centre.
[[nodiscard]] std::array<Vec3d, 4> tag_corners(double tag_size_m);

/// Parses Kalibr's YAML: target_type 'aprilgrid', tagCols, tagRows, tagSize (m), tagSpacing, and optionally codeOffset;
/// tagFamily is Lightwell's extension and optional. Errors: "NAME:LINE: the problem and the remedy".
[[nodiscard]] Result<TagBoard> parse_tag_board(std::string_view text, const std::string& name);
/// not_found: the file cannot be opened; data_loss: it cannot be read; otherwise as parse_tag_board().
[[nodiscard]] Result<TagBoard> load_tag_board(const std::string& path);
/// parse_tag_board() restores the same values exactly.
[[nodiscard]] std::string tag_board_to_text(const TagBoard& board);

}  // namespace lightwell
