// The sheet of paper on which a ball stands: a part of the ground plane with an albedo of its own.
#pragma once

#include <cstdint>
#include <span>

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

/// Multiplies the radiance of the sheet's samples by the ratio of the table's albedo to the sheet's, so that shadows
/// run on over its edge, and sets table_ratio; color stays. `covers`: of each sample, none `mixed`. The ratio is the
/// median over neighbours on both sides of the edge. With fewer than six pairs of them the smaller group of samples is
/// removed.
void equalize_sheet(GroundPlane& ground, std::span<const GroundCover> covers);

}  // namespace lightwell::marker
