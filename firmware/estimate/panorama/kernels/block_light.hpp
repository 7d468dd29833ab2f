// The vector kernel after lane_sums and block_sums: from a block's sums of codes to its light, peak, centroid and
// noise, for a vector of blocks at a time.
#pragma once

#include <array>
#include <cstddef>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// Arrays that this kernel reads have room for so many entries beyond the last block.
inline constexpr std::size_t kBlockLightPadding = 16;

/// What blocks' sums are worth, worked out once: an entry a block.
struct BlockWeights {
  const float *mean, *along_x,
      *along_y;         ///< Plain: the plane that fits the weights (sr), about the middle of the block.
  const float* half_x;  ///< Plain: that middle, pixels from the block's corner.
  const float *unit, *middle_x, *middle_y;  ///< Weighted: of the 8-bit weights: the unit makes them add up to
                                            ///< the total; their middle is in pixels from the corner.
  const float *total, *pixels;         ///< Sum of weights, solid angle over vignetting, sr; pixels that see something.
  const float *per_total, *per_pixel;  ///< 1 over these.
  const float* inverse_vignetting;               ///< Total by solid angle.
  const float* spread;                 ///< Total squared by pixels.
  const float* solid_angle;            ///< sr.
};

/// Of red, green and blue, an entry a block, in units of the kernels' sums.
struct BlockCodes {
  std::array<float*, 3> sum, across, down;  ///< Linear values; times column and times row within the block.
  std::array<float*, 3> top;                ///< Linear value of the largest code, in units of plain sums.
  float* clipped;                           ///< Pixels that are saturated.
};

/// What is the same for a run of blocks.
struct BlockRun {
  bool weighted = false;
  float unit = 1, plain_unit = 1;             ///< Linear value per unit of the sums, and of plain sums.
  float linear_from = 0;                      ///< Linear value of code 0.
  float cut_off = 0;                          ///< Weighted: what the products of a pixel lose, on average.
  float half_y = 0;                           ///< Middle row.
  float radiance = 1;                         ///< Per linear value.
  std::array<float, 3> white{}, luminance{};  ///< White balance; weights of luminance with it.
  float read2 = 0, shot = 0, cut_noise = 0;
  const float* step =
      nullptr;  ///< How far apart codes are, 4096 of them by linear value in 1/4095; null: plain_unit everywhere.
};

/// As in BlockSums: integral of radiance over solid angle, largest luminance, where the light sits in pixels from the
/// middle, solid angle that is saturated.
struct BlockLight {
  CellSum* light;
  float *peak, *offset_x, *offset_y, *clipped;
};

/// Sums over the blocks: linear values' variance times spread, what black and rounding hide, solid angle that is
/// clipped.
struct BlockErrorSums {
  double noise = 0, bias = 0, clipped_sr = 0;
};

/// Fills `blocks` entries of `out`; nothing beyond is written.
BlockErrorSums convert_block_sums(const BlockRun& run, const BlockWeights& weights, const BlockCodes& codes, std::size_t blocks,
                           const BlockLight& out);

}  // namespace lightwell::estimate
