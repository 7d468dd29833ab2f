// Surfaces of the ground plane other than the table: the sheet of paper on which a ball stands, objects on the table.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// What a ground sample shows.
enum class GroundCover : std::uint8_t {
  table,
  sheet,
  mixed,  ///< An edge of the sheet, or its tag.
};

/// What a square of the ground plane shows that is aligned with the plane's axes. `half_step`: half its side, m.
[[nodiscard]] GroundCover ground_cover(const MarkerBody& body, const PosedBody& posed_body, Vec3d position,
                                       double half_step);

/// Removes samples of objects on the table: those whose colour differs from the median of their surface by more than
/// the colours of lamps explain. The measure is an illuminant invariant (Finlayson, Hordley, Lu & Drew 2006, "On the
/// removal of shadows from images"), so that shadows of lamps of other colours stay. Objects of the table's colour
/// stay, too. `covers`: of each sample; the same are removed.
void remove_clutter(GroundPlane& ground, std::vector<GroundCover>& covers);

/// Multiplies the radiance of the sheet's samples by the ratio of the table's albedo to the sheet's, so that shadows
/// run on over its edge, and sets table_ratio; color stays. `covers`: of each sample, none `mixed`. The ratio is the
/// median over neighbours on both sides of the edge. With fewer than six pairs of them the smaller group of samples is
/// removed.
void equalize_sheet(GroundPlane& ground, std::span<const GroundCover> covers);

}  // namespace lightwell::marker
