// What sums of codes are worth, worked out once for a rig: which blocks are summed together, the weights of their
// pixels where these have weights of their own, and what makes light of the sums.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/pixel.hpp>

#include "calibration/lens_table.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/kernels/block_light.hpp"

namespace lightwell::estimate {

/// How samples lie in a row.
enum class Lanes : std::uint8_t { interleaved, planar, mosaic };
inline constexpr std::size_t kLaneKinds = 3;
[[nodiscard]] Lanes lanes_of(PixelFormat format);

/// Neighbouring blocks of one kind within a row of blocks.
struct WeightRun {
  int first, end;  ///< Columns of blocks.
  bool weighted;   ///< Each pixel by its own weight; else all alike, and the sums by the plane that fits them.
  std::array<std::size_t, kLaneKinds> weights;  ///< Where its rows of weights begin.
};

/// The lanes that a kernel runs over for a run: at least kMinLanes of them.
struct LaneRange {
  std::size_t begin, count;
};

/// Nothing is planned for blocks of one pixel, and of more than kMaxRows rows.
class CodeWeights {
 public:
  CodeWeights(const RigTable& table, const BlockLayout& layout);

  /// Of a row of blocks; blocks that see nothing are in none.
  [[nodiscard]] std::span<const WeightRun> runs(int lens, int block_row) const {
    return rows_[static_cast<std::size_t>(lens)][static_cast<std::size_t>(block_row)];
  }
  [[nodiscard]] LaneRange lane_range(int lens, Lanes lanes, const WeightRun& run) const;
  /// Of a weighted run: rows of a stretch's count each.
  [[nodiscard]] const std::uint8_t* weights(const WeightRun& run, Lanes lanes) const {
    return bytes_.data() + run.weights[static_cast<std::size_t>(lanes)];
  }
  /// From this block on.
  [[nodiscard]] BlockWeights block_weights(std::size_t block, Lanes lanes) const;

 private:
  /// An entry a block, with room for the kernel: BlockWeights says what they are.
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
