// Blocks that hang together and are bright, across seams, poles and lenses.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>

#include "calibration/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bright_pixels.hpp"

namespace lightwell::estimate {

class BlockFloodFill {
 public:
  /// As a cosine of the reach: no limit.
  static constexpr float kUnlimitedReach = -2;
  /// It stops at so many blocks.
  static constexpr std::size_t kMaxBlocks = 4096;

  /// The others stay the caller's; `sums` are those of each frame in turn. `pixels` tells which pixels are beside each
  /// other, here and now.
  BlockFloodFill(const RigTable& table, const BlockLayout& layout, const CellGrid& grid, const BlockSums& sums,
             const BrightPixels& pixels);

  /// Fills blocks() with those connected to `block` (itself first) whose peak is at least `floor` and whose middle is
  /// within `cos_reach` of `axis`, but for those that taken(block) holds back. Returns their luminance together, over
  /// that of the darkest block around them.
  template <class Taken>
  double run(std::uint32_t block, float floor, Vec3f axis, float cos_reach, Taken&& taken);

  /// Of the last run.
  [[nodiscard]] std::span<const std::uint32_t> blocks() const { return blocks_; }
  [[nodiscard]] bool has(std::size_t block) const { return mark_[block] == run_; }

 private:
  const CellGrid& grid_;
  const BlockSums& sums_;
  /// Blocks beside block b: beside_[first_[b]] up to first_[b + 1].
  std::vector<std::uint32_t> first_, beside_;
  std::vector<std::uint32_t> blocks_;
  std::vector<std::uint32_t> mark_;  ///< The run that reached a block last.
  std::uint32_t run_ = 0;
};

template <class Taken>
double BlockFloodFill::run(std::uint32_t block, float floor, Vec3f axis, float cos_reach, Taken&& taken) {
  ++run_;
  blocks_.assign(1, block);
  mark_[block] = run_;
  double luminance = 0, sr = 0;
  float beside = std::numeric_limits<float>::infinity();
  for (std::size_t next = 0; next < blocks_.size(); ++next) {
    const std::uint32_t at = blocks_[next];
    luminance += std::max(0.0F, sums_.sum[at].luminance());
    sr += grid_.solid_angle(at);
    for (std::uint32_t i = first_[at]; i < first_[at + 1]; ++i) {
      const std::uint32_t other = beside_[i];
      if (!(sums_.peak[other] >= floor)) {
        beside = std::min(beside, sums_.sum[other].luminance() / grid_.solid_angle(other));
        continue;
      }
      if (mark_[other] == run_ || taken(other)) continue;
      if (dot(grid_.direction(other), axis) < cos_reach || blocks_.size() >= kMaxBlocks) continue;
      mark_[other] = run_;
      blocks_.push_back(other);
    }
  }
  return std::isfinite(beside) ? std::max(0.0, luminance - std::max(0.0, static_cast<double>(beside)) * sr) : luminance;
}

}  // namespace lightwell::estimate
