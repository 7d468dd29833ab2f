// Which lights the saturated pixels of a frame belong to.
#pragma once

#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"

namespace lightwell::estimate {

/// Fills `tracks` with the tracks of the lights that saturated blocks belong to; leaves it empty where too much of what
/// is saturated belongs to none.
void find_clipped_lights(const BlockSums& sums, const CellGrid& grid, std::span<const Light> lights,
                         std::vector<std::uint32_t>& tracks);

}  // namespace lightwell::estimate
