// Interleaved sampling: each frame reads a part of the runs of blocks, in a rotation of N frames. What was read is
// kept, with its projection, so that constant light has no other error than a full frame.
//
//   read       the runs of one group of N; those that hold the brightest blocks of a light (watched); all of them in
//              the first frame, after a pause, where the clock does not advance, and while light changes
//   change     the projection of a group minus that of its last reading, N frames ago; its RMS irradiance counts beyond
//              kNoiseSigmas of the two readings' noise
//   stale      groups are spread evenly over the sphere. Where one has changed, each of the others is assumed to have
//              changed by kGroupMargin as much, until it is read. The sum of these irradiances is the possible error of
//              the runs that were not read
//   refresh    where it exceeds kMaxStale of all light, the next frame reads everything
//
// A lamp that is switched on in a run that is not watched is read after N - 1 frames at the latest; in the next frame,
// where its light on other surfaces is seen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/time.hpp>

#include "estimate/common/cells.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/panorama/code_pass.hpp"

namespace lightwell::estimate {

/// Not thread-safe. Allocates when the first rotation begins.
class RunRotation {
 public:
  /// Refers to all arguments.
  RunRotation(const CodePass& pass, const BlockLayout& layout, const CellGrid& grid);

  /// By number of a run, whether this frame reads it. `interleave`: N, 2 or more. `time`: mid-exposure.
  [[nodiscard]] std::span<const std::uint8_t> begin_frame(int interleave, ProbeTime time);

  /// The blocks of a run are cells `begin` to before `end`.
  struct Run {
    std::size_t begin, end;
    std::uint32_t position;  ///< In the order of groups: its group is `position` modulo N.
  };
  [[nodiscard]] std::span<const Run> runs() const { return runs_; }

  /// Once for each run that was read, after the pass: its light, and that which is off the middle of its blocks.
  void set(std::size_t run, std::span<const CellSum> sums, std::span<const CellGrid::CentroidOverride> overrides,
           double centroid_offset);
  /// After the last set(): the projection of all runs.
  void project(Projection& out);
  /// Of all runs, as given to set().
  [[nodiscard]] double centroid_offset() const;
  /// RMS irradiance that the light of the runs that were not read may have changed by.
  [[nodiscard]] double stale() const;

  /// Blocks with the brightest pixels of the frame's lights: the next frame reads their runs.
  void watch(std::span<const std::uint32_t> blocks);
  /// The next frame reads all runs, as the first one. For frames that were read without a rotation.
  void restart() { started_ = false; }

 private:
  /// RMS irradiance beyond the noise of two readings, whose variance (IntegrationErrors::noise) is `noise`.
  [[nodiscard]] static double change_of(const CellGrid::Totals& difference, double noise);

  const CodePass& pass_;
  const CellGrid& grid_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> run_of_block_;
  std::vector<std::uint8_t> read_, watched_;
  std::vector<std::array<std::array<float, kRowCount>, 3>> projections_;  ///< By run.
  std::vector<double> centroid_offsets_;                                  ///< By run.
  CellGrid::Totals total_{}, difference_{};
  double difference_noise_ = 0;
  std::vector<double> stale_;  ///< By group, RMS irradiance.
  int interleave_ = 0;
  std::uint32_t group_ = 0;  ///< Of this frame.
  bool started_ = false;     ///< The last frame belongs to the rotation.
  bool all_ = false;         ///< This frame reads all runs.
  bool refresh_ = false;     ///< The next frame does.
  ProbeTime last_;
};

}  // namespace lightwell::estimate
