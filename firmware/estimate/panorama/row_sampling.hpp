// Sampling of rows: of most blocks a pass reads a part of the rows. The raw samples of all rows are summed without
// being decoded, which costs little, and correct what was read.
//
//   sampled    blocks whose weights fit a plane, of 16 rows, of a bracket also of 8. Of one exposure three rows are
//              read, or two pairs of rows where two share their colour; of a bracket, in which a pixel costs most, two
//   estimate   sum over the rows read, times solid angle of the block over that of these rows, times
//              f(mean code of all rows) / f(mean code of the rows read), f: codes to linear values. This is the ratio
//              estimator with an auxiliary variable (Cochran 1977, "Sampling Techniques", chapter 6). It is exact where
//              f is linear and the colour of the block is uniform
//   whole      blocks that this may get wrong by more than a limit are read again with all rows: small bright lights,
//              edges of windows, saturated pixels, motion between exposures
//   error      RowError of the others: in quadrature over blocks what is independent; as sums, a tenth of the
//              corrections and half of their squares. Where these sums are large (stripes all around), all rows are
//              read
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
#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/code_weights.hpp"
#include "estimate/panorama/kernels/block_scan.hpp"
#include "imaging/pixel_layout.hpp"

namespace lightwell::estimate {

/// Not thread-safe. Allocates in its constructor only.
class RowSampling {
 public:
  /// Refers to `layout`.
  RowSampling(const RigParameters& rig, const RigTable& table, const BlockLayout& layout, const CodeWeights& weights);

  /// Whether some blocks can be sampled, at a gain: pictures of integer codes in one format, which must be decoded.
  /// `reader`, here and below: bound to the bracket.
  [[nodiscard]] bool supports(const RowReader& reader) const;
  /// The rows that are read of a block.
  [[nodiscard]] SampledRows rows(const RowReader& reader) const { return reading_of(reader).rows; }

  /// By block, those of `read` (empty: of all) that are sampled. Valid until the next call of this object.
  [[nodiscard]] std::span<const std::uint8_t> sampled(std::span<const std::uint8_t> read);
  /// The others of `read`. The same.
  [[nodiscard]] std::span<const std::uint8_t> others(std::span<const std::uint8_t> read);

  /// Turns the sums of the rows that were read of the blocks of `sampled` into sums of whole blocks, with their
  /// RowError. Returns those whose own error is more than `max_error` of the luminance of all blocks: they must be read
  /// whole.
  [[nodiscard]] std::span<const std::uint8_t> estimate(const RowReader& reader, std::span<const std::uint8_t> sampled,
                                                       double max_error, BlockSums& blocks);

 private:
  /// What a block's raw samples tell, in linear values of one exposure.
  struct Scan {
    float all, read;  ///< Of the mean codes of all rows and of those that are read.
    float largest;
    bool saturated;
  };
  struct Block {
    float solid_angle = 0, inverse_vignetting = 1;  ///< sr; mean, weighted by solid angle.
    float scale = 0;                                ///< Its solid angle over that of the rows that are read.
    float shift = 0;  ///< Middle of the rows that are read minus that of the block, pixels.
  };
  /// Precomputed for a choice of rows.
  struct Reading {
    SampledRows rows;
    float count = 0;  ///< Of the rows that are read of a block.
    std::vector<Block> blocks;
    float gradient = 1;  ///< Variance of the rows of a block over that of the rows that are read.
  };
  struct Lens {
    std::array<std::vector<float>, kCodeBits.size()> linear;  ///< Linear values by code.
    std::vector<float> luma;                                  ///< The same by luma, of grey.
    std::array<unsigned, kCodeBits.size()> saturated_from{};
    std::array<float, 3> inverse_white{1, 1, 1};
    float largest_white = 1;
  };
  void plan(const RigTable& table, const CodeWeights& weights, Reading& out) const;
  [[nodiscard]] const Reading& reading_of(const RowReader& reader) const;
  [[nodiscard]] Scan scan(const View& view, const BlockLayout::Place& place, const Reading& reading) const;
  /// `own` is infinite where the block must be read whole.
  [[nodiscard]] RowError estimate_block(const RowReader& reader, std::size_t block, const Reading& reading,
                                        BlockSums& blocks) const;

  const BlockLayout& layout_;
  std::vector<Lens> lenses_;
  std::vector<std::uint8_t> plane_, others_;  ///< By block, whether it can be sampled; whether not.
  std::vector<std::uint8_t> sampled_, whole_;
  Reading single_, pairs_, bracket_;  ///< For one exposure; where two rows share their colour; for brackets.
  bool any_ = false;
  bool linear_ = true;  ///< The codes of all lenses are.
};

}  // namespace lightwell::estimate
