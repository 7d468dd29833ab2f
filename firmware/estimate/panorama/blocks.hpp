// The one pass over the pixels: sums of light over square blocks of each lens's picture.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "calibration/lens_table.hpp"
#include "estimate/common/block_layout.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/common/row_reader.hpp"

namespace lightwell::estimate {

/// What the pass leaves of a bracket.
struct BlockSums {
  std::vector<CellSum> sum;  ///< Integral of radiance over each block's solid angle.
  std::vector<float> peak;   ///< Largest luminance of a pixel with solid angle.
  double clipped_sr = 0;     ///< Solid angle saturated in every exposure.
  double noise = 0;          ///< Sum of solid_angle² times the variance of radiance.
  double bias = 0;           ///< Sum of solid_angle times what rounding and black may hide, all one way.
  /// Where the luminance of each block sits, in pixels from the middle of its solid angle.
  std::vector<float> offset_x, offset_y;
  /// By block, how many of the shortest exposures its light is of; only BracketPass fills it.
  std::vector<std::uint8_t> exposures;
  /// Luminance, integrated over solid angle, of blocks where something moved between the exposures: what the block
  /// gives or by how much the exposures differ, whichever is more.
  double motion_luminance = 0;
  std::vector<float> clipped;  ///< By block, the solid angle saturated in every exposure.
  ReadStatistics counts;

  explicit BlockSums(const BlockLayout& layout)
      : sum(layout.size()),
        peak(layout.size()),
        offset_x(layout.size()),
        offset_y(layout.size()),
        exposures(layout.size()),
        clipped(layout.size()) {}
  /// What is counted over all blocks, not the blocks themselves.
  void clear() {
    clipped_sr = noise = bias = motion_luminance = 0;
    counts = {};
    std::fill(clipped.begin(), clipped.end(), 0.0F);
  }
};

/// Runs the pass, with row buffers of its own.
class BlockPass {
 public:
  BlockPass(const RigTable& table, const BlockLayout& layout);
  void run(RowReader& reader, BlockSums& out);

  /// Middle of a block's solid angle, in pixels from the block's corner.
  struct Middle {
    float x, y;
  };
  [[nodiscard]] Middle middle(std::size_t block) const { return {middle_x_[block], middle_y_[block]}; }

 private:
  const RigTable& table_;
  const BlockLayout& layout_;
  LinearRow row_;
  std::vector<float> r_, g_, b_, peak_, low_, clipped_;  ///< Per column, over the rows of one row of blocks.
  /// Middle of each block's solid angle, in pixels from the block's corner.
  std::vector<float> middle_x_, middle_y_;
};

}  // namespace lightwell::estimate
