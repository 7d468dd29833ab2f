// Weights of the codes of CodePass: solid angle divided by relative illumination, precomputed for a rig.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/pixel.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

/// Layout of samples in a row.
enum class Lanes : std::uint8_t { interleaved, planar, mosaic };
inline constexpr std::size_t kLaneKinds = 3;
[[nodiscard]] Lanes lanes_of(PixelFormat format);

/// Neighbouring blocks of a row of blocks: columns of blocks from `first` to before `end`.
struct BlockRange {
  int first, end;
};

/// Neighbouring blocks of one kind within a row of blocks.
struct WeightRun {
  BlockRange blocks;
  bool weighted;  ///< Pixels have 8-bit weights; false: the fitted plane is applied to sums and moments.
  std::array<std::size_t, kLaneKinds> weights;  ///< Offset of its rows of weights.
};

/// Range of lanes that a kernel processes: at least kMinLanes.
struct LaneRange {
  std::size_t begin, count;
};

/// Weights of code sums, precomputed for a rig. Within a block, the weight of a pixel (solid angle divided by relative
/// illumination) is a plane over x and y, so that sums and first moments of the codes give the weighted sum. Where a
/// plane does not fit (edge of a lens, overlap of two), each pixel has its own 8-bit weight. Empty for blocks of one
/// pixel, and of more than kMaxRows rows.
class CodeWeights {
 public:
  CodeWeights(const RigTable& table, const BlockLayout& layout);

  /// Runs of a row of blocks. Blocks without solid angle are in none.
  [[nodiscard]] std::span<const WeightRun> runs(int lens, int block_row) const {
    return rows_[static_cast<std::size_t>(lens)][static_cast<std::size_t>(block_row)];
  }
  /// The lanes of a range of blocks of `run`, and others of it where these are fewer than kMinLanes.
  [[nodiscard]] LaneRange lane_range(int lens, Lanes lanes, const WeightRun& run, BlockRange blocks) const;
  /// Weights of a weighted run: rows of lane_range(run.blocks).count elements.
  [[nodiscard]] const std::uint8_t* weights(const WeightRun& run, Lanes lanes) const {
    return bytes_.data() + run.weights[static_cast<std::size_t>(lanes)];
  }
  /// Pointers to the coefficients of this block and the following ones.
  [[nodiscard]] BlockWeights block_weights(std::size_t block, Lanes lanes) const;

 private:
  /// One element per block, plus padding for the kernel. See BlockWeights.
  struct BlockWeightArrays {
    explicit BlockWeightArrays(std::size_t blocks);
    std::vector<float> mean, along_x, along_y, half_x, total, pixels, per_total, per_pixel, inverse_vignetting, spread,
        solid_angle;
    std::array<std::vector<float>, kLaneKinds> unit, middle_x, middle_y;
  };

  void plan_row(int lens, int top, std::vector<WeightRun>& runs);
  void plan_block(int lens, std::size_t block);
  void plan_weights(int lens, int top, WeightRun& run);
  void round_weights(int lens, std::size_t block, Lanes lanes, const LaneRange& s, std::uint8_t* weights);

  const RigTable& table_;
  const BlockLayout& layout_;
  BlockWeightArrays block_weights_;
  std::vector<std::vector<std::vector<WeightRun>>> rows_;  ///< By lens and row of blocks.
  std::vector<std::uint8_t> bytes_;
};

}  // namespace lightwell::estimate
