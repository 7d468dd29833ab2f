// The vector kernel under the pass over brackets: one row of pixels of all exposures is merged, weighed by what each
// pixel sees and added to sums by column; and each exposure is held against the next longer one. One source for every
// vector unit (Highway), as kernels/lane_sums.hpp; tests go through all of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "camera/frame.hpp"
#include "estimate/panorama/kernels/ycbcr_planes.hpp"

namespace lightwell::estimate {

/// What the codes of one depth are worth.
struct CodeLut {
  /// Value of each code in proportion to light: times `unit` it is the linear value. Where codes are linear themselves,
  /// linear[c] is c + linear[0].
  std::vector<float> linear;
  float unit = 1;
  /// 1 / variance of that value (read and shot noise, rounding), cut to the upper half of a float: any weight near the
  /// best one merges well, as long as value and weight are summed with the same. 0 where the code is saturated.
  std::vector<float> weight;
  /// Of 8-bit codes: bytes 1 to 3 of the linear value (15 bits of mantissa are kept), 2 and 3 of the weight.
  alignas(64) std::array<std::array<std::uint8_t, 256>, 3> linear_bytes{};
  alignas(64) std::array<std::array<std::uint8_t, 256>, 2> weight_bytes{};
  unsigned saturated_from = 0;
  float saturated_linear = 1;          ///< Of the lowest saturated code.
  float hidden = 0, hidden_until = 0;  ///< How much rounding and black may hide, at most, of a value below the second.
};

/// linear8: interleaved8 whose codes are linear.
enum class BracketSource : std::uint8_t { interleaved8, linear8, planes8, mosaic8, mosaic16 };

/// Where one exposure's row lies; of the mosaics a pair of rows, whose quads count as the pixels then.
struct ExposureRow {
  /// interleaved8, linear8: r g b by turns. planes8: codes of r, g, b, and what
  /// shared_tops() gives. mosaic: the red and the blue row. At pixel 0.
  std::array<const std::uint8_t*, 4> at{};
  std::ptrdiff_t ahead = 0;  ///< Bytes from `at` to what is needed next and is fetched already; 0: nothing.
  float scale = 1;           ///< Radiance per linear value, relative to that of the longest exposure: at least 1.
};

/// Sums by column, in radiance of the longest exposure's linear values, without white balance, over solid angle and
/// inverse vignetting. A column is a pixel, or a quad of a mosaic.
struct BracketColumns {
  float *r, *g, *b;
  float* low;      ///< Luminance times depth.
  float* peak;     ///< Largest luminance of a pixel with solid angle.
  float* noise;    ///< Weight squared times variance.
  float* bias;     ///< What rounding and black may hide.
  float* clipped;  ///< Solid angle saturated in every exposure.
  /// By how much the brightest channel is brighter in exposure k than in k + 1, summed over pixels that both tell,
  /// unweighted; and how much of that can be noise.
  std::array<float*, kMaxBracket - 1> difference, noise_allowance;
};

struct BracketRow {
  BracketSource source = BracketSource::interleaved8;
  const CodeLut* lut = nullptr;
  std::array<ExposureRow, kMaxBracket> exposures{};  ///< Shortest first.
  int count = 0;
  const float* solid_angle = nullptr;  ///< At pixel 0; of mosaics, of the upper row.
  const float* inverse_vignetting = nullptr;
  std::size_t next_row = 0;          ///< Floats to the lower row of a mosaic.
  std::ptrdiff_t ahead = 0;          ///< As ExposureRow::ahead, in floats.
  std::array<float, 3> luminance{};  ///< Weights of r, g, b, white balance included.
  /// Each of two exposures may be off by so many deviations of a pixel in all pixels of a block alike, and by this
  /// share of its radiance, before anything counts as moved.
  float deviations = 3, share = 0.02F;
  float depth = 0;  ///< Row within the block; the middle of a pair.
};

/// The largest code of each pixel of one row of planes r, g, b or of two, whose pixels share colour by pairs or by
/// quads; 255 where one of those that share has a code of at least `saturated_from`, as its colour is wrong in all of
/// them then. `pixels`: even, at least 64. `below`, `out_below`: null of one row.
void shared_tops(const PlaneRow& row, const PlaneRow* below, std::size_t pixels, unsigned saturated_from,
                 std::uint8_t* out, std::uint8_t* out_below);

/// Sums `blocks` blocks of `edge` columns (a power of two), the first of which begins at column `first`, in place: the
/// sum (the largest of `peak`) of block k comes to entry first + k. `pairs`: entries of `differ` and `doubt` that are
/// used. `across` has room as the others, and becomes the sum of column within the block times luminance, `luminance`
/// that of luminance. What lies up to 64 entries beyond the blocks is read, too.
struct FoldedColumns {
  float *luminance, *across;
};
void fold_bracket_columns(const BracketColumns& columns, int pairs, const std::array<float, 3>& luminance,
                          std::size_t first, int edge, std::size_t blocks, const FoldedColumns& out);

/// Adds pixels (quads) [begin, end), begin < end. Whole vectors of up to 64 are read: what lies before readable_end,
/// which is at least 64. Columns beside those wanted get entries of no weight, in `differ` and `doubt` of some.
void merge_bracket_row(const BracketRow& row, std::size_t begin, std::size_t end, std::size_t readable_end,
                       const BracketColumns& out);

}  // namespace lightwell::estimate
