// Interleaved sampling: each frame reads a part of the runs of blocks, in a rotation of N frames. What was read is
// kept, with its projection, so that constant light has no other error than a full frame.
//
//   read       the runs of one group of N; the blocks with the cores of lights, and those around them (watched); all
//              blocks in the first frame, after a pause, where the clock does not advance, and while light changes
//   change     the projection of a group minus that of its last reading, N frames ago; its RMS irradiance counts beyond
//              kNoiseSigmas of the two readings' noise
//   stale      groups are spread evenly over the sphere. Where one has changed, each of the others is assumed to have
//              changed by kGroupMargin as much, until it is read. The sum of these irradiances is the possible error of
//              the runs that were not read. Where watched blocks have changed, the rest of their lights is assumed to
//              have changed with them
//   refresh    where it exceeds kMaxStale of all light, the next frame reads everything
//
// A lamp that is switched on in a block that is not watched is read after N - 1 frames at the latest; in the next
// frame, where its light on other surfaces is seen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/time.hpp>

#include "estimate/common/cells.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/panorama/blocks.hpp"

namespace lightwell::estimate {

/// Not thread-safe. Allocates when the first rotation begins.
class RunRotation {
 public:
  /// Refers to `grid`.
  RunRotation(const BlockLayout& layout, const CellGrid& grid);

  /// By block, whether this frame reads it. `interleave`: N, 2 or more. `time`: mid-exposure.
  [[nodiscard]] std::span<const std::uint8_t> begin_frame(int interleave, ProbeTime time);

  /// Neighbouring blocks with solid angle of a row of blocks, at most kMaxPixels wide: `begin` to before `end`.
  struct Run {
    std::size_t begin, end;
    std::uint32_t position;  ///< In the order of groups: its group is `position` modulo N.
  };
  static constexpr int kMaxPixels = 192;
  static_assert(kMaxPixels <= CellGrid::kMaxCellsInFloat, "a block may be one pixel");
  [[nodiscard]] std::span<const Run> runs() const { return runs_; }
  /// Numbers of the runs of which this frame reads blocks.
  [[nodiscard]] std::span<const std::uint32_t> changed() const { return changed_; }

  /// Once for each of these, after the pass: `overrides` and `centroid_offset` of its blocks.
  void set(std::size_t run, const BlockSums& blocks, std::span<const CellGrid::CentroidOverride> overrides,
           double centroid_offset);
  /// Of all runs, as given to set().
  struct Sums {
    BlockTotals blocks;
    double centroid_offset = 0;
  };
  /// After the last set(): the projection of all runs, and their sums.
  Sums finish_frame(Projection& out);
  /// RMS irradiance that the light of the runs that were not read may have changed by.
  [[nodiscard]] double stale() const;

  /// The next frame reads these blocks of lights. Those of the last call are forgotten. `unread`: light of other blocks
  /// relative to that of these, the largest of all lights.
  void watch(std::span<const std::uint32_t> blocks, double unread);
  /// The next frame reads all runs, as the first one. For frames that were read without a rotation.
  void restart() { started_ = false; }

 private:
  struct Difference;
  /// RMS irradiance beyond the noise.
  [[nodiscard]] static double change_of(const Difference& difference);
  [[nodiscard]] bool in_group(std::size_t run) const {
    return runs_[run].position % static_cast<std::uint32_t>(interleave_) == group_;
  }

  const CellGrid& grid_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> run_of_block_, changed_;
  std::vector<std::uint8_t> read_;      ///< By block.
  std::vector<std::uint8_t> has_read_;  ///< By run, whether it is in changed_.
  std::vector<std::uint32_t> watched_;
  std::vector<std::uint8_t> is_watched_;              ///< By block.
  std::vector<CellGrid::PartialTotals> projections_;  ///< By run.
  std::vector<Sums> sums_;                            ///< By run.
  /// Sum of changes, and of the noise of both readings.
  struct Difference {
    CellGrid::Totals light{};
    double noise = 0;
  };
  CellGrid::Totals total_{};
  Difference of_group_, of_watched_;
  std::vector<double> stale_;  ///< By group, RMS irradiance.
  double stale_lights_ = 0;    ///< The same of the parts of lights that are not watched.
  double unread_ = 0;
  int interleave_ = 0;
  std::uint32_t group_ = 0;  ///< Of this frame.
  bool started_ = false;     ///< The last frame belongs to the rotation.
  bool all_ = false;         ///< This frame reads all runs.
  bool refresh_ = false;     ///< The next frame does.
  ProbeTime last_;
};

}  // namespace lightwell::estimate
