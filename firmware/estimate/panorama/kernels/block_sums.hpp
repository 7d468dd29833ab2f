// SIMD kernel that sums the lanes of lane_sums.hpp to blocks.
#pragma once

#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

/// Padding in lanes, because whole vectors of blocks are processed: the widest is 32 blocks of 16 lanes.
inline constexpr std::size_t kBlockPadding = 512;

/// Sums the lanes of `blocks` blocks of `edge` (1, 2, 4, 8 or 16) columns, each of `channels` (1 to 3) lanes, in place:
/// element [block * channels + channel] becomes the sum (`sum`, `early`) or maximum (`peak`) of the block, and `across`
/// the sum of linear value times column within the block, from 0. 16 columns of 16 rows of 65535 fit into 32 bits. The
/// arrays must have kBlockPadding elements more than blocks * edge * channels, with any content.
void sum_blocks(const LaneSums& lanes, int channels, int edge, std::size_t blocks, std::uint32_t* across);

}  // namespace lightwell::estimate
