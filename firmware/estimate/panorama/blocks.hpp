// Sums of radiance over square blocks of each lens's image, and the scalar pass that computes them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/frames/row_reader.hpp"

namespace lightwell::estimate {

/// Block sums of a bracket.
struct BlockSums {
  std::vector<CellSum> sum;  ///< Integral of radiance over each block's solid angle.
  std::vector<float> peak;   ///< Largest luminance of a pixel with solid angle.
  double clipped_sr = 0;     ///< Solid angle saturated in every exposure, sr.
  double noise = 0;          ///< Sum of solid_angle² times the variance of radiance.
  double bias = 0;           ///< Sum of solid_angle times near_black_bias().
  /// Centroid of each block's luminance, in pixels from the middle of its solid angle.
  std::vector<float> offset_x, offset_y;
  /// By block, the number of shortest exposures that were merged; filled by BracketPass only.
  std::vector<std::uint8_t> exposures;
  /// Sum over the blocks with motion between exposures: integral of luminance over the block, or the difference between
  /// the exposures, whichever is more.
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
  /// Resets totals and `clipped`; the other arrays are overwritten by a pass.
  void clear() {
    clipped_sr = noise = bias = motion_luminance = 0;
    counts = {};
    std::fill(clipped.begin(), clipped.end(), 0.0F);
  }
};

/// The pass for all formats, through RowReader. Owns its row buffers.
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
