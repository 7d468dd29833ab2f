// SIMD kernels that add a row of pixels to sums by column, as kernels/lane_sums.hpp one source for all instruction
// sets. Of BracketPass: merge the row in all exposures, weight it by solid angle and inverse vignetting, and compare
// each exposure with the next longer one. Of BlockPass: rows of floats.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimate/panorama/kernels/lane_sums.hpp"
#include "imaging/frame.hpp"

namespace lightwell::estimate {

/// The upper bytes of the floats of 256 codes, the highest first: what a vector unit that looks up bytes reads.
template <std::size_t kBytes>
using CodeBytes = std::array<std::array<std::uint8_t, 256>, kBytes>;

/// Lookup tables by code, for one bit depth.
struct CodeLut {
  /// Linear value of each code by `unit`; of 8-bit codes, the upper 24 bits. Linear codes: linear[c] is c + linear[0].
  std::vector<float> linear;
  float unit = 1;
  /// 1 / variance of that value (read noise, shot noise, rounding), the upper 16 bits of a float; 0 if saturated.
  std::vector<float> weight;
  CodeBytes<3> linear_bytes{};  ///< Of `linear`; of 8-bit codes only.
  CodeBytes<2> weight_bytes{};  ///< Of `weight`, the same.
  unsigned saturated_from = 0;
  float saturated_linear = 1;                       ///< Of the lowest saturated code.
  float near_black_bias = 0, near_black_limit = 0;  ///< Largest near_black_bias() of values below the limit.
};

/// Software prefetch of the data `ahead` bytes after `at`, which may be beyond the image: rows of many exposures are
/// too many streams for the hardware prefetcher.
inline void prefetch(const void* at, std::ptrdiff_t ahead, std::size_t bytes) {
  const std::uintptr_t from = reinterpret_cast<std::uintptr_t>(at) + static_cast<std::uintptr_t>(ahead);
  for (std::size_t i = 0; i < bytes; i += 64) __builtin_prefetch(reinterpret_cast<const void*>(from + i));
}

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
  /// Radiance of the brightest channel in exposure k minus that in k + 1, summed without weights over pixels valid in
  /// both; and its tolerance.
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
  /// Tolerances of the comparison of two exposures: sigmas of each pixel in each exposure; share of the radiance.
  float noise_sigmas = 3, relative_tolerance = 0.02F;
  float depth = 0;  ///< Row within the block; for a pair of rows, its middle.
};

/// Largest code of r, g, b of each pixel in one row (chroma shared by pairs) or two rows (by quads). 255 where a pixel
/// that shares the chroma has a code of at least `saturated_from`, because the colour of all of them is then wrong.
/// `pixels`: even, at least 64. `below`, `out_below`: null for one row.
void shared_tops(const PlaneRow& row, const PlaneRow* below, std::size_t pixels, unsigned saturated_from,
                 std::uint8_t* out, std::uint8_t* out_below);

/// Sums columns to blocks in place: `blocks` blocks of `edge` columns (1, 2, 4, 8 or 16), from column `first` on.
/// Element first + k becomes the sum of block k (of `peak`: the maximum). `pairs`: number of elements of `difference`
/// and `noise_allowance` in use. In `out`, `luminance` becomes the sum of luminance, `across` that of luminance times
/// column within the block.
struct FoldedColumns {
  float *luminance, *across;
};
void fold_bracket_columns(const BracketColumns& columns, int pairs, const std::array<float, 3>& luminance,
                          std::size_t first, int edge, std::size_t blocks, const FoldedColumns& out);

/// Adds pixels (quads) [begin, end), begin < end. Reads whole vectors of up to 64 pixels, before readable_end, which
/// must be at least 64. Other columns of these vectors are changed only in `difference` and `noise_allowance`.
void merge_bracket_row(const BracketRow& row, std::size_t begin, std::size_t end, std::size_t readable_end,
                       const BracketColumns& out);

/// Sums over the rows of a row of blocks, one element per column of pixels.
struct FloatColumns {
  float *r, *g, *b;  ///< Radiance times solid angle.
  float* low;        ///< Luminance times solid angle times the row's depth.
  float* peak;       ///< Largest luminance of a pixel with solid angle.
};

/// Adds a run of `pixels` pixels (floats r, g, b, any alignment) times `scale`. Adds nothing and returns false where
/// a value is NaN or not in [0, max_radiance].
[[nodiscard]] bool add_float_row(const std::byte* rgb, const float* solid_angle, std::size_t pixels, float scale,
                                 float max_radiance, float depth, const FloatColumns& out);

}  // namespace lightwell::estimate
