// A flat grid of AprilTags, as a value: which tags are where on it.
//   TagBoard            the grid, its corners in its own frame, validate()
//   load_tag_board, parse_tag_board, tag_board_to_text      Kalibr's YAML for targets of type 'aprilgrid'
//
// The board's frame: right-handed, metres, z = 0 is the paper and +Z points from it towards who reads it; +X to the
// right, +Y up (Kalibr's, and the house's: a board that stands upright in front of a wall needs no turning). The origin
// is the bottom left corner of the first tag. Numbers grow to the right and then upwards, row by row from the bottom.
//
//      6   7   8
//      3   4   5        y
//      0   1   2        |
//     ^                 +-- x
//     origin
//
// Corners of a tag, always in this order, which is AprilTag's and Kalibr's:
//   0 bottom left, 1 bottom right, 2 top right, 3 top left, of the tag upright, seen from its face.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "pose/tag_family.hpp"

namespace lightwell {

struct TagBoard {
  TagFamily family = TagFamily::tag36h11;
  int columns = 6, rows = 6;
  /// Metres between the corners that are detected: of tag36h11 the outer edges of its black frame; of
  /// tagStandard41h12 the edges between its white square and the black ring around it.
  double tag_size_m = 0.024;
  /// The gap between the squares of neighbours as a share of tag_size_m (Kalibr's tagSpacing).
  double spacing = 0.3;
  int first_id = 0;  ///< Kalibr's codeOffset.

  /// What cannot be printed or read: no tags, sizes that are not positive and finite, tags that overlap, numbers that
  /// the family does not have. Names the field and the remedy.
  [[nodiscard]] Status validate() const;

  // All below ask for a board that validates.
  [[nodiscard]] int tags() const { return columns * rows; }
  [[nodiscard]] double pitch_m() const { return tag_size_m * (1 + spacing); }
  /// From the first tag's left edge to the last one's right edge, and likewise upwards.
  [[nodiscard]] double width_m() const { return (columns - 1) * pitch_m() + tag_size_m; }
  [[nodiscard]] double height_m() const { return (rows - 1) * pitch_m() + tag_size_m; }
  [[nodiscard]] bool holds(TagFamily of, int id) const {
    return of == family && id >= first_id && id < first_id + tags();
  }
  /// Of a tag that the board holds: its four corners in the board's frame.
  [[nodiscard]] std::array<Vec3d, 4> corners(int id) const;
  /// Of a tag that the board holds: its centre in the board's frame.
  [[nodiscard]] Vec3d center(int id) const;
};

/// The corners of a single tag in its own frame: as a board's, but the origin is its centre.
[[nodiscard]] std::array<Vec3d, 4> tag_corners(double tag_size_m);

/// Kalibr's text: target_type 'aprilgrid', tagCols, tagRows, tagSize (m), tagSpacing, and optionally codeOffset;
/// tagFamily is ours and optional. Errors: "NAME:LINE: what and how to mend it". What a file says is its geometry: the
/// tags that Kalibr prints have a frame of two cells, which AprilTag 3 does not read; print with lightwell-calibrate.
[[nodiscard]] Result<TagBoard> parse_tag_board(std::string_view text, const std::string& name);
/// not_found, data_loss, or as parse_tag_board().
[[nodiscard]] Result<TagBoard> load_tag_board(const std::string& path);
/// The same numbers back, to the last bit, from parse_tag_board().
[[nodiscard]] std::string tag_board_to_text(const TagBoard& board);

}  // namespace lightwell
