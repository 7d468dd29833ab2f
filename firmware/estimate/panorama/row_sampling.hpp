// Sampling of rows: of most blocks a pass reads a part of the rows. The raw samples of the other rows are summed
// without being decoded, which costs little, and correct what was read.
//
//   sampled    blocks of 8 or 16 rows, inside the image, whose weights fit a plane: three rows of each are read, four
//   where
//              two rows share their colour
//   estimate   sum over the rows read, times solid angle of the block over that of these rows, times
//              f(mean code of all rows) / f(mean code of the rows read), f: codes to linear values. This is the ratio
//              estimator with an auxiliary variable (Cochran 1977, "Sampling Techniques", chapter 6). It is exact where
//              f is linear and the colour of the block is uniform
//   whole      blocks that this may get wrong by more than a limit are read again with all rows: small bright lights,
//              edges of windows, saturated pixels, motion between exposures
//   error      the possible errors of the others are part of the bound: in quadrature, because they are independent,
//   and
//              a tenth of the corrections and half of their squares as sums. Where these are large (stripes all
//              around), all rows are read
//
// There is no memory of earlier frames: constant light gives the same sums in every frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/kernels/block_scan.hpp"
#include "imaging/frame.hpp"
#include "imaging/pixel_layout.hpp"

namespace lightwell::estimate {

/// Not thread-safe. Allocates in its constructor only.
class RowSampling {
 public:
  /// Refers to `layout`. `plane`: by block, whether a plane fits the weights of its pixels; empty: no block is sampled.
  RowSampling(const RigParameters& rig, const RigTable& table, const BlockLayout& layout,
              std::span<const std::uint8_t> plane);

  /// Whether some blocks can be sampled, at a gain: pictures of integer codes in one format, which must be decoded.
  [[nodiscard]] bool supports(std::span<const Frame> bracket) const;
  /// The rows that are read of a block.
  [[nodiscard]] SampledRows rows(std::span<const Frame> bracket) const { return reading_of(bracket).rows; }

  /// By block, those of `read` (empty: of all) that are sampled. Valid until the next call of this object.
  [[nodiscard]] std::span<const std::uint8_t> sampled(std::span<const std::uint8_t> read);
  /// The others of `read`. The same.
  [[nodiscard]] std::span<const std::uint8_t> others(std::span<const std::uint8_t> read);

  /// Turns the sums of the rows that were read of the blocks of `sampled` into sums of whole blocks, with
  /// BlockSums::block_rows. Returns those whose possible error is more than `max_error` of the luminance of all blocks:
  /// they must be read whole. `bracket`: as it was passed to the pass.
  [[nodiscard]] std::span<const std::uint8_t> estimate(std::span<const Frame> bracket,
                                                       std::span<const std::uint8_t> sampled, double max_error,
                                                       BlockSums& blocks);

 private:
  /// What a block's raw samples tell, in linear values of one exposure.
  struct Scan {
    float all, read;  ///< Of the mean codes of all rows and of those that are read.
    float largest;
    bool saturated;
  };
  /// Precomputed for a choice of rows.
  struct Reading {
    SampledRows rows;
    std::vector<float> scale;  ///< By block, its solid angle over that of the rows that are read.
    std::vector<float> shift;  ///< By block, the middle of the rows that are read minus that of the block, pixels.
    float gradient = 1;        ///< Variance of the rows of a block over that of the rows that are read.
  };
  struct Lens {
    std::array<std::vector<float>, kCodeBits.size()> linear;  ///< Linear values by code.
    std::array<unsigned, kCodeBits.size()> saturated_from{};
    std::array<float, 3> inverse_white{1, 1, 1};
    float largest_white = 1;
  };
  struct Exposure {
    float radiance_per_linear;
    std::array<const View*, kMaxLenses> views;
  };
  void plan(const RigTable& table, Reading& out) const;
  [[nodiscard]] const Reading& reading_of(std::span<const Frame> bracket) const;
  void sort(std::span<const Frame> bracket);
  [[nodiscard]] Scan scan(const View& view, const BlockLayout::Place& place, const SampledRows& rows) const;
  /// Possible errors of a block, in units of BlockSums::sum: independent of other blocks, infinite where it must be
  /// read whole; with the sign of its correction; and of second order.
  struct Error {
    float own, common, bias;
  };
  [[nodiscard]] Error estimate_block(std::size_t block, const Reading& reading, BlockSums& blocks) const;

  const BlockLayout& layout_;
  std::vector<Lens> lenses_;
  std::vector<std::uint8_t> plane_, sampled_, whole_;
  Reading single_, pairs_, bracket_;  ///< For one exposure; where two rows share their colour; for brackets.
  std::vector<float> inverse_vignetting_, solid_angle_;
  std::vector<Error> errors_;                      ///< By block.
  std::array<Exposure, kMaxBracket> exposures_{};  ///< Of the current bracket, longest first.
  std::size_t exposure_count_ = 0;
  bool any_ = false;
  bool linear_ = true;  ///< The codes of all lenses are.
};

}  // namespace lightwell::estimate
