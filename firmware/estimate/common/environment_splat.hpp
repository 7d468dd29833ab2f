// From the cells of a rig to the texels of an octahedral square.
#pragma once

#include <span>

#include <lightwell/geometry.hpp>

#include "estimate/common/octahedral_grid.hpp"
#include "estimate/common/sparse_rows.hpp"

namespace lightwell::estimate {

/// Rows that turn the cells' integrals of radiance into the mean radiance of each texel. A cell is spread smoothly over
/// about twice its own radius, so that texels between the centres of coarser cells are filled. The spread is then
/// balanced in turns (Sinkhorn & Knopp 1967) until every texel is filled exactly once and every cell is given away
/// exactly once: then a constant sphere is constant, and energy is kept.
///
/// `direction` (unit, probe frame) and `solid_angle` (sr; cells without any are passed over) go together; cells should
/// not overlap. Where they cover the sphere (kFullCoverage) gaps are closed from the nearest cells; elsewhere what lies
/// farther from every cell than its own reach stays dark. Whoever wants another light there adds cells for it.
[[nodiscard]] SparseRows splat_rows(std::span<const Vec3f> direction, std::span<const float> solid_angle,
                                    const OctahedralGrid& grid);

}  // namespace lightwell::estimate
