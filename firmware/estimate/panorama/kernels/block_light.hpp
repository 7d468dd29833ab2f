// SIMD kernels that sum the lanes of lane_sums.hpp to blocks, and convert these sums of codes to light, peak, centroid
// and noise, a vector of blocks at a time.
#pragma once

#include <array>
#include <cstddef>

#include "estimate/common/cells.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

/// Sums the lanes of `blocks` blocks of `edge` (1, 2, 4, 8 or 16) columns, each of `channels` (1 to 3) lanes, in place:
/// element [block * channels + channel] becomes the sum (`sum`, `early`) or maximum (`peak`) of the block, and `across`
/// the sum of linear value times column within the block, from 0. 16 columns of 16 rows of 65535 fit into 32 bits.
void sum_blocks(const LaneSums& lanes, int channels, int edge, std::size_t blocks, std::uint32_t* across);

/// Number of elements of padding after the last block in arrays that this kernel reads.
inline constexpr std::size_t kBlockLightPadding = 16;

/// Precomputed coefficients, one element per block. A weight is solid angle divided by relative illumination, sr.
struct BlockWeights {
  /// Plain sums: the plane that fits the weights, about the middle of the block.
  const float *mean, *along_x, *along_y;
  const float* half_x;  ///< Plain sums: that middle, pixels from the block's corner.
  /// Weighted sums: unit of the 8-bit weights, so that they sum to `total`; their centroid, pixels from the corner.
  const float *unit, *middle_x, *middle_y;
  const float *total, *pixels;         ///< Sum of the weights, sr; number of pixels with solid angle.
  const float *per_total, *per_pixel;  ///< 1 / total, 1 / pixels.
  const float* inverse_vignetting;     ///< total / solid_angle.
  const float* spread;                 ///< total² / pixels.
  const float* solid_angle;            ///< sr.
};

/// Sums of codes of red, green and blue, one element per block, in units of the kernels' sums.
struct BlockCodes {
  std::array<float*, 3> sum, across, down;  ///< Sums of linear values; times column and times row within the block.
  std::array<float*, 3> top;                ///< Linear value of the largest code, in units of plain sums.
  float* clipped;                           ///< Number of saturated pixels.
};

/// Constants of a run of blocks.
struct BlockRun {
  bool weighted = false;
  float unit = 1, plain_unit = 1;             ///< Linear value per unit of the sums, and of plain sums.
  float linear_from = 0;                      ///< Linear value of code 0.
  float cut_off = 0;                          ///< Weighted sums: mean truncation error of the product of a pixel.
  float half_y = 0;                           ///< Middle row.
  float radiance = 1;                         ///< Radiance per linear value.
  std::array<float, 3> white{}, luminance{};  ///< White balance; weights of luminance with it.
  float read2 = 0, shot = 0, cut_noise = 0;
  const float* step = nullptr;  ///< Quantization step by linear value in 1/4095, 4096 elements; null: plain_unit.
};

/// Output arrays, as in BlockSums: integral of radiance over solid angle, largest luminance, centroid in pixels from
/// the middle, saturated solid angle.
struct BlockLight {
  CellSum* light;
  float *peak, *offset_x, *offset_y, *clipped;
};

/// Sums over blocks: variance of the linear value times `spread`, near_black_bias() times `total`, saturated solid
/// angle.
struct BlockErrorSums {
  double noise = 0, bias = 0, clipped_sr = 0;
};

/// Fills `blocks` elements of `out`; writes nothing beyond.
BlockErrorSums convert_block_sums(const BlockRun& run, const BlockWeights& weights, const BlockCodes& codes,
                                  std::size_t blocks, const BlockLight& out);

}  // namespace lightwell::estimate
