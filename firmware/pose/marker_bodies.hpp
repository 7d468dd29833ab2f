// Marker bodies as values: printed by lightwell-calibrate marker-sheet, stored in firmware/estimate/marker/bodies.
//
// Solids: origin in the centre; face 0 on top (normal +Y), the last face at the bottom (-Y). Between them are rings of
// faces from top to bottom; within a ring the face index increases with the azimuth from +Z towards +X,
// counter-clockwise seen from above. Each face of the lower half is opposite to one of the upper half, in the same
// order:
//   dodecahedron   1..5 normals 26.565 degrees above the horizon, 6 + k opposite to 1 + k
//   cube           1..4 normals +Z, +X, -Z, -X
//   icosahedron    1..3, then 4..9; 10 + k opposite to 4 + k, 16 + k opposite to 1 + k
// Tag ids are the face index plus first_id. The up axis of a tag is the one of the face's axes (from the middle of an
// edge through the centre, in either direction) nearest to +Y; on face 0 nearest to -Z, on the last face to +Z.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "pose/tag_board.hpp"

namespace lightwell {

/// Albedo of plain matte paper, including the white rim of a tag.
inline constexpr double kPaperAlbedo = 0.80;

enum class PaperKind : std::uint8_t {
  white,  ///< Plain paper.
  grey,   ///< Quadrants of 100, 75, 50 and 25 % of the paper's albedo, which extend the dynamic range of one exposure.
};

[[nodiscard]] std::string_view to_string(PaperKind kind);
/// invalid_argument: an unknown name; the message lists the known ones.
[[nodiscard]] Result<PaperKind> parse_paper_kind(std::string_view name);

/// Albedo of the quadrants: top left, top right, bottom left, bottom right of the upright tag.
[[nodiscard]] std::array<double, 4> quadrant_albedos(PaperKind kind);

/// A regular solid with a tag in the middle of each face.
struct SolidOptions {
  double size_m = 0.1;  ///< Distance between opposite faces.
  PaperKind paper = PaperKind::white;
  TagFamily family = TagFamily::tag36h11;
  int first_id = 0;
  double tag_size_m = 0;  ///< Distance between detected corners; 0: tag_size_for(inradius of a face).
};

/// invalid_argument: a size that is not positive, finite and at most 10 m; a tag that does not fit the face (the
/// message gives the largest that does); ids that the family does not have. The message names the field.
[[nodiscard]] Result<MarkerBody> make_dodecahedron(const SolidOptions& options = {});
[[nodiscard]] Result<MarkerBody> make_cube(const SolidOptions& options = {});
[[nodiscard]] Result<MarkerBody> make_icosahedron(const SolidOptions& options = {});

struct BallOnTagOptions {
  double ball_diameter_m = 0.04;
  double ball_albedo = kPaperAlbedo;
  PaperKind paper = PaperKind::white;  ///< The sheet around the tag.
  TagFamily family = TagFamily::tag36h11;
  int id = 0;
  double tag_size_m = 0;  ///< Distance between detected corners; 0: tag_size_for(0.75 ball_diameter_m).
};

/// Origin in the ball's centre, +Y up from the sheet. The up axis of the tag is -Z: seen from +Z the ball is behind the
/// tag, and it touches the sheet one diameter from the tag's centre. The sheet is a square of 2.5 diameters. Its
/// patches do not extend behind the tag's rim, so that none lies beneath the ball. Errors as for solids.
[[nodiscard]] Result<MarkerBody> make_ball_on_tag(const BallOnTagOptions& options = {});

/// Side of the square around a tag's centre that belongs to no patch, m: the tag with its white rim of one cell.
[[nodiscard]] double white_square_m(TagFamily family, double tag_size_m);
/// Size of the tag whose white square has the side `radius_m`, m, the cell rounded down to 0.1 mm; 0: no cell.
[[nodiscard]] double tag_size_for(TagFamily family, double radius_m);

}  // namespace lightwell
