// Families of AprilTags, and what a tag of each looks like.
//   shape_of       cells across, and which of them the border takes
//   tag_bitmap     a tag's cells, as they are printed
//   parse_tag_family, to_string
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell {

enum class TagFamily : std::uint8_t {
  tag36h11,          ///< 587 tags, black edge outside, the one that everybody prints.
  tagStandard41h12,  ///< 2,115 tags; data lie outside of the edge, so that a cell is larger for the same paper.
};

[[nodiscard]] std::string_view to_string(TagFamily family);

/// By the name that AprilTag gives it. invalid_argument names those that are known.
[[nodiscard]] Result<TagFamily> parse_tag_family(std::string_view name);

struct TagShape {
  int cells = 0;            ///< Across the whole tag, a white rim included where the family prints one.
  int edge_cells = 0;       ///< Across the square whose corners are detected: the tag's size is their width.
  int tags = 0;             ///< Numbers run from 0 to here, exclusively.
  bool dark_inside = true;  ///< Whether that square's rim is dark and its surroundings bright, or the other way round.
};

[[nodiscard]] TagShape shape_of(TagFamily family);

/// A tag seen from its face, upright.
struct TagBitmap {
  int cells = 0;
  std::vector<bool> dark;  ///< Row by row from the top, `cells` a row.

  [[nodiscard]] bool is_dark(int column, int row) const { return dark[static_cast<std::size_t>(row * cells + column)]; }
};

/// invalid_argument for a number that the family does not have.
[[nodiscard]] Result<TagBitmap> tag_bitmap(TagFamily family, int id);

}  // namespace lightwell
