// From the lanes of lane_sums.hpp to blocks.
#pragma once

#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

/// Vectors of blocks are worked on whole: the widest is 32 blocks of 16 lanes.
inline constexpr std::size_t kBlockPadding = 512;

/// Sums the lanes of `blocks` blocks of `edge` (1, 2, 4, 8 or 16) columns, each of `channels` (1 to 3) lanes, in place:
/// entry [block * channels + channel] of `sum` and `early`, the largest of `peak`, and in `across` the sum of the
/// column within the block, from 0, times linear value. 16 columns of 16 rows of 65535 keep all sums within 32 bits.
/// The arrays have room for kBlockPadding more than blocks * edge * channels lanes, whatever these hold.
void sum_blocks(const LaneSums& lanes, int channels, int edge, std::size_t blocks, std::uint32_t* across);

}  // namespace lightwell::estimate
