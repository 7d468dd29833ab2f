// Sums of radiance over square blocks of each lens's image and over the sphere, and the scalar pass that computes them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/frames/row_reader.hpp"

namespace lightwell::estimate {

/// Possible errors of the light of a block of which a part of the rows was read (RowSampling), as integrals of
/// luminance.
struct RowError {
  float own = 0;     ///< Independent of other blocks.
  float common = 0;  ///< Of first order, with its sign: may be the same in all blocks.
  float bias = 0;    ///< Of second order.
};

/// Sums over blocks.
struct BlockTotals {
  double clipped_sr = 0;  ///< Solid angle saturated in every exposure, sr.
  double noise = 0;       ///< Sum of solid_angle² times the variance of radiance.
  double bias = 0;        ///< Sum of solid_angle times near_black_bias().
  /// Over the blocks with motion between exposures: integral of luminance, or that of the difference if that is more.
  double motion_luminance = 0;
  double row_variance = 0, row_common = 0, row_bias = 0;  ///< Of RowError: sum of own², of common, of bias.

  /// Possible error of the luminance of all blocks.
  [[nodiscard]] double row_error() const { return std::sqrt(row_variance) + std::abs(row_common) + row_bias; }
  BlockTotals& operator+=(const BlockTotals& o) {
    clipped_sr += o.clipped_sr;
    noise += o.noise;
    bias += o.bias;
    motion_luminance += o.motion_luminance;
    row_variance += o.row_variance;
    row_common += o.row_common;
    row_bias += o.row_bias;
    return *this;
  }
};

/// The integral of luminance over all blocks; a rounding error of 4e-6 at most.
[[nodiscard]] double luminance_of_all(std::span<const CellSum> blocks);

/// Block sums of a bracket, and their totals.
struct BlockSums : BlockTotals {
  std::vector<CellSum> sum;  ///< Integral of radiance over each block's solid angle.
  std::vector<float> peak;   ///< Largest luminance of a pixel with solid angle.
  /// Centroid of each block's luminance, in pixels from the middle of its solid angle.
  std::vector<float> offset_x, offset_y;
  /// By block, the number of shortest exposures that were merged; filled by BracketPass only.
  std::vector<std::uint8_t> exposures;
  std::vector<float> clipped;  ///< By block, the solid angle saturated in every exposure.
  /// By block, its part of `noise`, `bias` and `motion_luminance`; filled by the passes that can leave blocks out.
  std::vector<float> block_noise, block_bias, block_motion;
  std::vector<RowError> row_error_of_block;
  ReadStatistics counts;

  explicit BlockSums(const BlockLayout& layout)
      : sum(layout.size()),
        peak(layout.size()),
        offset_x(layout.size()),
        offset_y(layout.size()),
        exposures(layout.size()),
        clipped(layout.size()),
        block_noise(layout.size()),
        block_bias(layout.size()),
        block_motion(layout.size()),
        row_error_of_block(layout.size()) {}
  /// Totals of the blocks from `begin` to before `end`, where each block has its part.
  [[nodiscard]] BlockTotals totals_of(std::size_t begin, std::size_t end) const;
  void clear_totals() {
    static_cast<BlockTotals&>(*this) = {};
    counts = {};
  }
  /// Resets totals and `clipped`; the other arrays are overwritten by a pass.
  void clear() {
    clear_totals();
    std::fill(clipped.begin(), clipped.end(), 0.0F);
  }
  /// Sets a block, except for its errors. `luminance_sum`, `across`, `down`: integral of luminance, and the same times
  /// column and times row within the block, in any common unit. `saturated`: solid angle.
  void set(std::size_t block, const CellSum& light, float largest, float luminance_sum, float across, float down,
           BlockLayout::Middle middle, float saturated) {
    sum[block] = light;
    peak[block] = largest;
    offset_x[block] = luminance_sum > 0 ? across / luminance_sum - middle.x : 0;
    offset_y[block] = luminance_sum > 0 ? down / luminance_sum - middle.y : 0;
    clipped[block] = saturated;
    clipped_sr += saturated;
  }
};

/// Calls visit(first, last) for the ranges of blocks from `begin` to before `end` that are read, `first` to before
/// `last`. `read`: by block, whether it is read; empty: all are.
template <class Visit>
void for_each_read(std::span<const std::uint8_t> read, std::size_t begin, std::size_t end, Visit&& visit) {
  if (read.empty()) return visit(begin, end);
  const auto find = [&](std::size_t from, int value) {
    const void* const found = std::memchr(&read[from], value, end - from);
    return found == nullptr ? end : static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - read.data());
  };
  for (std::size_t first = begin; first < end;) {
    first = find(first, 1);
    if (first == end) return;
    const std::size_t last = find(first, 0);
    visit(first, last);
    first = last;
  }
}

/// Result of SphereIntegrator::integrate(). Sums are radiance (linear value / (exposure_s * gain * vignetting)) times
/// solid angle. Only LightFinder, GreyPatchReader, TexelSums and, of brackets, RowProfiler read pixels again.
struct FrameIntegral {
  BlockSums blocks;             ///< By block of the rig. The blocks of a missing lens are filled, or zero.
  std::vector<CellSum> unseen;  ///< By cell that no lens of the rig sees: filled, or zero.
  Projection projection;        ///< Of blocks and unseen cells, lights included.
  double observed_sr = 0;       ///< Solid angle observed by the lenses of this bracket.
  float mean_luminance = 0;     ///< Of the observed directions.
  bool filled = false;          ///< Unobserved directions were filled.
  /// Sum over the blocks without centroid correction: luminance times the angle between centroid and middle, rad.
  double centroid_offset = 0;
  bool interleaved = false;  ///< Blocks may be of earlier frames: see RunRotation.
  double stale = 0;          ///< RMS irradiance that may have changed in blocks that this frame did not read.
  double shared_chroma = 0;  ///< SharedChroma::error().

  /// `unseen_cells`: number of elements of `unseen`.
  FrameIntegral(const BlockLayout& layout, std::size_t unseen_cells) : blocks(layout), unseen(unseen_cells) {}
};

/// The pass for all formats, through RowReader. Owns its row buffers.
class BlockPass {
 public:
  BlockPass(const RigTable& table, const BlockLayout& layout);
  void run(RowReader& reader, BlockSums& out);

 private:
  const RigTable& table_;
  const BlockLayout& layout_;
  LinearRow row_;
  std::vector<float> r_, g_, b_, peak_, low_, clipped_;  ///< Per column, over the rows of one row of blocks.
};

}  // namespace lightwell::estimate
