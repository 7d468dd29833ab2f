// Assigns the saturated pixels of a frame to lights.
#pragma once

#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"

namespace lightwell::estimate {

/// Fills `tracks` with the tracks of the lights to which saturated blocks belong. Leaves it empty where less than three
/// quarters of the saturated solid angle belongs to lights. `lights`: strongest first. Returns the index of the
/// strongest one in `tracks`, or -1.
int find_clipped_lights(const BlockSums& sums, const CellGrid& grid, std::span<const Light> lights,
                        std::vector<std::uint32_t>& tracks);

}  // namespace lightwell::estimate
