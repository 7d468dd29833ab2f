// AprilTag families and the printed pattern of their tags.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

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

/// invalid_argument: an id that the family does not have.
[[nodiscard]] Result<TagBitmap> tag_bitmap(TagFamily family, int id);

}  // namespace lightwell
