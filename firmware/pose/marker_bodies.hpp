// Bodies to print, cut and fold, made as values: what lightwell-calibrate marker-sheet prints and
// firmware/estimate/marker/bodies holds.
//   make_dodecahedron, make_cube, make_icosahedron   a regular solid with a tag in the middle of each face
//   make_ball_on_tag                                 a tag on a sheet that lies on the table, a matte ball behind it
//   white_square_m, tag_size_for                     how much of a face a tag and its white rim take
//
// Solids: origin in the centre, face 0 on top (normal +Y), the last one below (-Y), the body stands on it. Between them
// rings from top to bottom; in a ring numbers grow with the azimuth from +Z towards +X, counter-clockwise seen from
// above. In the lower half each face is opposite to one of the upper half, in the same order:
//   dodecahedron   1..5 normals 26.565 degrees above the horizon, 6 + k opposite to 1 + k
//   cube           1..4 towards +Z, +X, -Z, -X
//   icosahedron    1..3, then 4..9; 10 + k opposite to 4 + k, 16 + k opposite to 1 + k
// Tags are numbered as faces, from first_id on. A tag's up is the face's axis (from an edge's middle through the
// centre, either way) that is nearest to +Y, on face 0 nearest to -Z, on the last one to +Z.
//
// A face around its tag: a white rim that belongs to no patch, being too narrow to be sampled; the rest is cut by the
// tag's x and y axes into four quadrants, each of one albedo. A quadrant without the rim's corner is not convex: it is
// two patches, above the rim and beside it.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "pose/tag_family.hpp"

namespace lightwell {

/// Albedo of plain matte paper, and so of a tag's white rim.
inline constexpr double kPaperAlbedo = 0.80;

enum class PaperKind : std::uint8_t {
  white,  ///< Paper all over.
  grey,   ///< Quadrants of 100, 75, 50 and 25 % of the paper's albedo: one exposure reads bright and dim light.
};

[[nodiscard]] std::string_view to_string(PaperKind kind);
/// invalid_argument names those that are known.
[[nodiscard]] Result<PaperKind> parse_paper_kind(std::string_view name);

/// Albedo of the quadrants: top left, top right, bottom left, bottom right of the upright tag.
[[nodiscard]] std::array<double, 4> quadrant_albedos(PaperKind kind);

struct SolidOptions {
  double size_m = 0.1;  ///< From a face to the one opposite.
  PaperKind paper = PaperKind::white;
  TagFamily family = TagFamily::tag36h11;
  int first_id = 0;
  double tag_size_m = 0;  ///< Between the corners that are detected; 0: tag_size_for() the circle that a face holds.
};

/// invalid_argument naming the field: a size that is not positive, finite and at most 10 m, a tag that does not fit a
/// face (with the largest that does), numbers that the family does not have.
[[nodiscard]] Result<MarkerBody> make_dodecahedron(const SolidOptions& options = {});
[[nodiscard]] Result<MarkerBody> make_cube(const SolidOptions& options = {});
[[nodiscard]] Result<MarkerBody> make_icosahedron(const SolidOptions& options = {});

struct BallOnTagOptions {
  double ball_diameter_m = 0.04;
  double ball_albedo = kPaperAlbedo;
  PaperKind paper = PaperKind::white;  ///< Of the sheet around the tag.
  TagFamily family = TagFamily::tag36h11;
  int id = 0;
  double tag_size_m = 0;  ///< 0: tag_size_for() three quarters of the ball's diameter.
};

/// Origin in the ball's centre, +Y up from the sheet, the tag's up is -Z: seen upright from +Z the ball stands behind
/// the tag and touches the sheet one diameter from the tag's centre. The sheet is 2.5 diameters square. Its patches end
/// where the tag's rim ends, so that none lies beneath the ball. Errors as of solids.
[[nodiscard]] Result<MarkerBody> make_ball_on_tag(const BallOnTagOptions& options = {});

/// Side of the square around a tag's centre that a quadrant leaves white: the tag with the rim that its family asks
/// for, one cell.
[[nodiscard]] double white_square_m(TagFamily family, double tag_size_m);
/// The tag whose white square is as wide as `radius_m`, in cells of whole tenths of a millimetre, downwards. 0 where
/// that is none.
[[nodiscard]] double tag_size_for(TagFamily family, double radius_m);

}  // namespace lightwell
