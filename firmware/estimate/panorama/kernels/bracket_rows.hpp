// SIMD kernels of BracketPass: merge one row of pixels of all exposures, weight it by solid angle and inverse
// vignetting, add it to sums by column, and compare each exposure with the next longer one. One source for all
// instruction sets (Highway), as kernels/lane_sums.hpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimate/panorama/kernels/ycbcr_planes.hpp"
#include "imaging/frame.hpp"

namespace lightwell::estimate {

/// Lookup tables by code, for one bit depth.
struct CodeLut {
  /// Linear value of each code, divided by `unit`. Where codes are linear, linear[c] is c + linear[0].
  std::vector<float> linear;
  float unit = 1;
  /// 1 / variance of that value (read noise, shot noise, rounding), rounded to the upper 16 bits of a float: weights
  /// need not be precise. 0 where the code is saturated.
  std::vector<float> weight;
  /// For 8-bit codes: bytes 1 to 3 of the linear value (15 bits of mantissa), bytes 2 and 3 of the weight.
  alignas(64) std::array<std::array<std::uint8_t, 256>, 3> linear_bytes{};
  alignas(64) std::array<std::array<std::uint8_t, 256>, 2> weight_bytes{};
  unsigned saturated_from = 0;
  float saturated_linear = 1;                       ///< Of the lowest saturated code.
  float near_black_bias = 0, near_black_limit = 0;  ///< Largest near_black_bias() of values below the limit.
};

/// linear8: interleaved8 whose codes are linear.
enum class BracketSource : std::uint8_t { interleaved8, linear8, planes8, mosaic8, mosaic16 };

/// Pointers to one exposure's row; for mosaics to a pair of rows, whose quads are processed like pixels.
struct ExposureRow {
  /// Pixel 0 of: the interleaved row (interleaved8, linear8); the planes of r, g, b and shared_tops() (planes8); the
  /// red and the blue row (mosaics).
  std::array<const std::uint8_t*, 4> at{};
  std::ptrdiff_t ahead = 0;  ///< Bytes from `at` to the data to prefetch.
  float scale = 1;           ///< Radiance per linear value, relative to that of the longest exposure: at least 1.
};

/// Sums by column of radiance times solid angle times inverse vignetting. Radiance is in linear values of the longest
/// exposure, without white balance. A column is one pixel wide, or one quad of a mosaic.
struct BracketColumns {
  float *r, *g, *b;
  float* low;      ///< Luminance times depth.
  float* peak;     ///< Largest luminance of a pixel with solid angle.
  float* noise;    ///< Squared weight times variance.
  float* bias;     ///< Possible bias near black.
  float* clipped;  ///< Solid angle saturated in every exposure.
  /// Radiance of the brightest channel in exposure k minus that in k + 1, summed without weights over pixels that are
  /// valid in both; and the tolerance of this difference.
  std::array<float*, kMaxBracket - 1> difference, noise_allowance;
};

struct BracketRow {
  BracketSource source = BracketSource::interleaved8;
  const CodeLut* lut = nullptr;
  std::array<ExposureRow, kMaxBracket> exposures{};  ///< Shortest first.
  int count = 0;
  const float* solid_angle = nullptr;  ///< Of pixel 0; for mosaics, in the upper row.
  const float* inverse_vignetting = nullptr;
  std::size_t next_row = 0;          ///< Floats from the upper to the lower row of a mosaic.
  std::ptrdiff_t ahead = 0;          ///< As ExposureRow::ahead, in floats.
  std::array<float, 3> luminance{};  ///< Weights of r, g, b, white balance included.
  /// Tolerances of the comparison of two exposures: standard deviations of a pixel, for each exposure, in all pixels of
  /// a block; and share of the radiance.
  float noise_sigmas = 3, relative_tolerance = 0.02F;
  float depth = 0;  ///< Row within the block; for a pair of rows, its middle.
};

/// Largest code of r, g, b of each pixel in one row (chroma shared by pairs) or two rows (by quads). 255 where a pixel
/// that shares the chroma has a code of at least `saturated_from`, because the colour of all of them is then wrong.
/// `pixels`: even, at least 64. `below`, `out_below`: null for one row.
void shared_tops(const PlaneRow& row, const PlaneRow* below, std::size_t pixels, unsigned saturated_from,
                 std::uint8_t* out, std::uint8_t* out_below);

/// Sums columns to blocks in place: `blocks` blocks of `edge` columns (a power of two), from column `first` on. Element
/// first + k becomes the sum of block k (of `peak`: the maximum). `pairs`: number of elements of `difference` and
/// `noise_allowance` in use. In `out`, `luminance` becomes the sum of luminance, `across` that of luminance times
/// column within the block. Up to 64 elements beyond the blocks are read, too.
struct FoldedColumns {
  float *luminance, *across;
};
void fold_bracket_columns(const BracketColumns& columns, int pairs, const std::array<float, 3>& luminance,
                          std::size_t first, int edge, std::size_t blocks, const FoldedColumns& out);

/// Adds pixels (quads) [begin, end), begin < end. Reads whole vectors of up to 64 pixels, before readable_end, which
/// must be at least 64. Other columns of these vectors are changed only in `difference` and `noise_allowance`.
void merge_bracket_row(const BracketRow& row, std::size_t begin, std::size_t end, std::size_t readable_end,
                       const BracketColumns& out);

}  // namespace lightwell::estimate
