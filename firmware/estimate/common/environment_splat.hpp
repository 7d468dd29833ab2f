// Resamples the cells of a rig to the texels of an octahedral map (splatting).
#pragma once

#include <span>

#include <lightwell/geometry.hpp>

#include "estimate/common/octahedral_grid.hpp"
#include "estimate/common/sparse_rows.hpp"

namespace lightwell::estimate {

/// Rows that convert the cells' integrals of radiance to the mean radiance of each texel. A smooth kernel of about
/// twice the cell's radius fills texels between the centres of coarse cells. The weights are then balanced alternately
/// (Sinkhorn & Knopp 1967, "Concerning nonnegative matrices and doubly stochastic matrices") until the rows of every
/// texel sum to its solid angle and those of every cell to its own: a constant sphere remains constant, and energy is
/// conserved.
///
/// `direction` (unit, probe frame) and `solid_angle` (sr; cells with 0 are ignored) correspond; cells should not
/// overlap. Where they cover the sphere (kFullCoverage), gaps are filled from the nearest cells. Otherwise directions
/// beyond the reach of every cell stay dark; callers add cells for unseen directions if they are to be filled.
[[nodiscard]] SparseRows splat_rows(std::span<const Vec3f> direction, std::span<const float> solid_angle,
                                    const OctahedralGrid& grid);

}  // namespace lightwell::estimate
