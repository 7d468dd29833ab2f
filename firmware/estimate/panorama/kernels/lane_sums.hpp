// SIMD kernels of CodePass. lane_sums.cpp: sums over the rows of a block, for all lanes of a row at once, of 8-bit
// codes and of 16-bit words. ycbcr_planes.cpp: rows of YCbCr to planes of r, g, b codes. block_light.cpp: sums of lanes
// to blocks, and these to light, peak, centroid and noise, a vector of blocks at a time. One source for all instruction
// sets (Highway), dispatched at run time; tests run all of them with hwy::SetSupportedTargetsForTest().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "estimate/common/cells.hpp"
#include "estimate/panorama/kernels/code_table.hpp"

namespace lightwell::estimate {

/// Largest number of rows per call: more would overflow 16-bit sums of codes.
inline constexpr int kMaxRows = 16;
/// Smallest number of lanes of a row: kernels read whole vectors, and shift the last one back. The widest vector of the
/// architecture, bytes.
#if defined(__x86_64__)
inline constexpr std::size_t kMinLanes = 64;
#else
inline constexpr std::size_t kMinLanes = 16;
#endif

/// One element per lane, the position of a sample in a row: 3 x + c for interleaved colour, else x.
struct LaneSums {
  std::uint32_t* sum;      ///< Sum of linear values (weighted: times weight / 256).
  std::uint32_t* early;    ///< Sum of linear value times (rows - y), y from 0; rows * sum - early is the first moment.
  std::uint16_t* peak;     ///< Largest code with a nonzero weight.
  std::uint16_t* clipped;  ///< Number of codes of at least `clipped_from` with a nonzero weight.
};

/// `rows` rows of 8-bit codes.
struct CodeRows {
  const std::uint8_t* first;
  std::size_t stride;      ///< Bytes between rows that are summed.
  int rows;                ///< 1 to kMaxRows.
  const CodeTable* table;  ///< Null: the code itself is the linear value (plain) or 257 times it (weighted).
  unsigned clipped_from;   ///< 256 or more: no code is clipped.
};

/// Rows of 16-bit little-endian words, masked to at most 12 bits: the linear value (plain), or 16 times it (weighted).
struct WordRows {
  const std::uint8_t* first;
  std::size_t stride;
  int rows;
  std::uint16_t mask;
  unsigned clipped_from;
};

/// Weights w / 256 of the samples: a byte per lane, rows `stride` bytes apart. Null `first`: plain sums.
struct LaneWeights {
  const std::uint8_t* first = nullptr;
  std::size_t stride = 0;
};

/// Sums lanes [0, lanes), lanes >= kMinLanes. `out` has as many elements.
void sum_lanes(const CodeRows& rows, const LaneWeights& weights, std::size_t lanes, const LaneSums& out);
void sum_wide_lanes(const WordRows& rows, const LaneWeights& weights, std::size_t lanes, const LaneSums& out);

/// Pointers to a row of each plane.
struct PlaneRow {
  std::uint8_t *r, *g, *b;
};

/// Converts one row of `pixels` pixels (even, at least kMinLanes) as rgb8_of_ycbcr601() does.
void planes_of_yuyv(const std::uint8_t* row, std::size_t pixels, const PlaneRow& out);
/// Converts two rows that share their chroma. For a single row, pass its luma and planes twice.
void planes_of_nv12(const std::uint8_t* upper_luma, const std::uint8_t* lower_luma, const std::uint8_t* chroma,
                    std::size_t pixels, const PlaneRow& upper, const PlaneRow& lower);

/// Over neighbouring samples of chroma (Cb and Cr) in a row of `pixels` pixels, whose differences c are more than
/// kMinChromaChange codes: the sum of c (c + l / 2), l: difference of a luma of each; the factor is at most 255. The
/// last pixels, which do not fill a vector, are left out.
[[nodiscard]] std::uint64_t chroma_changes_of_yuyv(const std::uint8_t* row, std::size_t pixels);
[[nodiscard]] std::uint64_t chroma_changes_of_nv12(const std::uint8_t* luma, const std::uint8_t* chroma,
                                                   std::size_t pixels);
/// Noise changes chroma by less.
inline constexpr int kMinChromaChange = 8;

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
  float unit = 1, plain_unit = 1;  ///< Linear value per unit of the sums, and of plain sums.
  float linear_from = 0;           ///< Linear value of code 0.
  float cut_off = 0;               ///< Weighted sums: mean truncation error of the product of a pixel.
  float half_y = 0;                ///< Middle of the rows that are summed.
  /// Where plain sums are of a part of the rows: pixels between these; their middle minus that of the block; the part.
  float row_step = 1, row_shift = 0, share = 1;
  float radiance = 1;                         ///< Radiance per linear value.
  std::array<float, 3> white{}, luminance{};  ///< White balance; weights of luminance with it.
  float read2 = 0, shot = 0, cut_noise = 0;
  const float* step = nullptr;  ///< Quantization step by linear value in 1/4095, 4096 elements; null: plain_unit.
};

/// Output arrays, as in BlockSums: integral of radiance, largest luminance, centroid, saturated solid angle, variance
/// of the integral, its bias near black.
struct BlockLight {
  CellSum* light;
  float *peak, *offset_x, *offset_y, *clipped, *noise, *bias;
};

/// Sums of the last three over blocks.
struct BlockErrorSums {
  double noise = 0, bias = 0, clipped_sr = 0;
};

/// Fills `blocks` elements of `out`; writes nothing beyond.
BlockErrorSums convert_block_sums(const BlockRun& run, const BlockWeights& weights, const BlockCodes& codes,
                                  std::size_t blocks, const BlockLight& out);

}  // namespace lightwell::estimate
