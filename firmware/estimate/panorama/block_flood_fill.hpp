// Flood fill over bright blocks, across seams, poles and lenses.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bright_pixels.hpp"

namespace lightwell::estimate {

class BlockFloodFill {
 public:
  /// Value of `cos_reach` without a limit.
  static constexpr float kUnlimitedReach = -2;
  /// Largest number of blocks of a run.
  static constexpr std::size_t kMaxBlocks = 4096;

  /// Refers to `grid`. `pixels` is used in the constructor alone, for the adjacency of pixels.
  BlockFloodFill(const RigTable& table, const BlockLayout& layout, const CellGrid& grid, const BrightPixels& pixels);

  /// Fills blocks() with the blocks connected to `block` (first itself) whose peak luminance is at least `floor`, whose
  /// middle is within `cos_reach` of `axis`, and for which excluded(block) is false. Returns the integral of their
  /// luminance above the mean luminance of the darkest adjacent block.
  template <class Excluded>
  double run(const BlockSums& sums, std::uint32_t block, float floor, Vec3f axis, float cos_reach, Excluded&& excluded);

  /// Blocks of the last run.
  [[nodiscard]] std::span<const std::uint32_t> blocks() const { return blocks_; }
  [[nodiscard]] bool has(std::size_t block) const { return mark_[block] == run_; }

 private:
  const CellGrid& grid_;
  /// Neighbours of block b: neighbours_[first_neighbour_[b]] to neighbours_[first_neighbour_[b + 1] - 1].
  std::vector<std::uint32_t> first_neighbour_, neighbours_;
  std::vector<std::uint32_t> blocks_;
  std::vector<std::uint32_t> mark_;  ///< By block, the last run that contains it.
  std::uint32_t run_ = 0;
};

template <class Excluded>
double BlockFloodFill::run(const BlockSums& sums, std::uint32_t block, float floor, Vec3f axis, float cos_reach,
                           Excluded&& excluded) {
  ++run_;
  blocks_.assign(1, block);
  mark_[block] = run_;
  double luminance = 0, sr = 0;
  float darkest = std::numeric_limits<float>::infinity();
  for (std::size_t next = 0; next < blocks_.size(); ++next) {
    const std::uint32_t at = blocks_[next];
    luminance += std::max(0.0F, sums.sum[at].luminance());
    sr += grid_.solid_angle(at);
    for (std::uint32_t i = first_neighbour_[at]; i < first_neighbour_[at + 1]; ++i) {
      const std::uint32_t other = neighbours_[i];
      if (!(sums.peak[other] >= floor)) {
        darkest = std::min(darkest, sums.sum[other].luminance() / grid_.solid_angle(other));
        continue;
      }
      if (mark_[other] == run_ || excluded(other)) continue;
      if (dot(grid_.direction(other), axis) < cos_reach || blocks_.size() >= kMaxBlocks) continue;
      mark_[other] = run_;
      blocks_.push_back(other);
    }
  }
  return std::isfinite(darkest) ? std::max(0.0, luminance - std::max(0.0, static_cast<double>(darkest)) * sr)
                                : luminance;
}

}  // namespace lightwell::estimate
