#include "estimate/panorama/run_rotation.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimate/common/error_bound.hpp"

namespace lightwell::estimate {
namespace {

/// Largest possible error by runs that were not read, relative to the RMS irradiance of the scene, without a refresh.
/// Twice the smallest sampling part of the bound.
constexpr double kMaxStale = 2e-3;
/// The RMS irradiance of noise alone scatters by a quarter, because few coefficients make the irradiance.
constexpr double kNoiseSigmas = 3;
/// Longest time between two frames of a rotation.
constexpr Duration kMaxPause{1'000'000'000};
/// Groups hold different parts of the scene: in rooms, a light that changes everywhere changes them by 3 to 15 %
/// differently (interleave_test).
constexpr double kGroupMargin = 1.25;
constexpr std::uint32_t kNoRun = 0xFFFFFFFF;

}  // namespace

RunRotation::RunRotation(const BlockLayout& layout, const CellGrid& grid)
    : grid_(grid), run_of_block_(layout.size(), kNoRun), read_(layout.size()), is_watched_(layout.size()) {
  std::uint32_t within = 0;
  for (std::size_t block = 0; block < layout.size(); ++block) {
    const BlockLayout::Place& place = layout.place(block);
    if (place.x == 0) within = 0;
    if (!(grid.solid_angle(block) > 0)) continue;
    const bool continues = place.x > 0 && !runs_.empty() && runs_.back().end == block;
    if (!continues || (block - runs_.back().begin) * static_cast<std::size_t>(layout.edge()) >= kMaxPixels)
      runs_.push_back({block, block, static_cast<std::uint32_t>(place.y / layout.edge() + place.lens) + 3 * within++});
    runs_.back().end = block + 1;
    run_of_block_[block] = static_cast<std::uint32_t>(runs_.size() - 1);
  }
  has_read_.resize(runs_.size());
  changed_.reserve(runs_.size());
  watched_.reserve(layout.size());
}

std::span<const std::uint8_t> RunRotation::begin_frame(int interleave, ProbeTime time) {
  const std::int64_t since = (time - last_).ns;
  all_ = !started_ || refresh_ || interleave != interleave_ || since <= 0 || since > kMaxPause.ns;
  if (interleave != interleave_) {
    projections_.resize(runs_.size());
    sums_.resize(runs_.size());
    stale_.assign(static_cast<std::size_t>(interleave), 0);
    interleave_ = interleave;
    started_ = false;
  }
  if (!started_) {
    total_ = {};
    for (CellGrid::PartialTotals& of_run : projections_) of_run = {};
  }
  last_ = time;
  group_ = (group_ + 1) % static_cast<std::uint32_t>(interleave);
  of_group_ = of_watched_ = {};
  std::ranges::fill(read_, std::uint8_t{0});
  std::ranges::fill(has_read_, std::uint8_t{0});
  changed_.clear();
  for (std::size_t run = 0; run < runs_.size(); ++run) {
    if (!all_ && !in_group(run)) continue;
    std::fill(&read_[runs_[run].begin], &read_[runs_[run].end - 1] + 1, std::uint8_t{1});
    has_read_[run] = 1;
    changed_.push_back(static_cast<std::uint32_t>(run));
  }
  for (const std::uint32_t block : watched_) {
    const std::uint32_t run = run_of_block_[block];
    if (run == kNoRun) continue;
    read_[block] = 1;
    if (has_read_[run] == 0) changed_.push_back(run);
    has_read_[run] = 1;
  }
  return read_;
}

void RunRotation::set(std::size_t run, const BlockSums& blocks, std::span<const CellGrid::CentroidOverride> overrides,
                      double centroid_offset) {
  const auto [begin, end, position] = runs_[run];
  CellGrid::PartialTotals light;
  grid_.add(begin, end, blocks.sum, overrides, light);
  CellGrid::PartialTotals& kept = projections_[run];
  const auto add_change = [&](CellGrid::Totals& to) {
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < kRowCount; ++i)
        to[k][i] += static_cast<double>(light.c[k][i]) - static_cast<double>(kept.c[k][i]);
  };
  const Sums sums{blocks.totals_of(begin, end), centroid_offset};
  add_change(total_);
  if (in_group(run) || !all_) {
    Difference& difference = in_group(run) ? of_group_ : of_watched_;
    add_change(difference.light);
    // The noise of this reading; that of the last one was about the same.
    difference.noise += 2 * sums.blocks.noise;
  }
  kept = light;
  sums_[run] = sums;
}

double RunRotation::change_of(const Difference& difference) {
  Projection change;
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) change.c[i][k] = difference.light[k][i];
  const IrradianceRms irradiance = irradiance_rms(change);
  const double largest = std::max(irradiance.plain, irradiance.weighted);
  return largest > kNoiseSigmas * noise_rms({.noise = difference.noise}) ? largest : 0;
}

RunRotation::Sums RunRotation::finish_frame(Projection& out) {
  grid_.fit(total_, out);
  const double change = started_ ? kGroupMargin * change_of(of_group_) : 0;
  started_ = true;
  stale_lights_ = all_ ? 0 : stale_lights_ + kGroupMargin * unread_ * change_of(of_watched_);
  for (double& stale : stale_) stale = all_ ? 0 : std::max(stale, change);
  stale_[group_] = 0;
  const IrradianceRms scene = irradiance_rms(out);
  const double limit = kMaxStale * std::min(scene.plain, scene.weighted);
  // While all is read, the group's change is that of one frame.
  refresh_ = (all_ ? change * interleave_ : stale()) > limit;
  Sums all;
  for (const Sums& of_run : sums_) {
    all.blocks += of_run.blocks;
    all.centroid_offset += of_run.centroid_offset;
  }
  return all;
}

double RunRotation::stale() const { return std::accumulate(stale_.begin(), stale_.end(), stale_lights_); }

void RunRotation::watch(std::span<const std::uint32_t> blocks, double unread) {
  unread_ = unread;
  for (const std::uint32_t block : watched_) is_watched_[block] = 0;
  watched_.clear();
  for (const std::uint32_t block : blocks) {
    if (is_watched_[block] == 0) watched_.push_back(block);
    is_watched_[block] = 1;
  }
}

}  // namespace lightwell::estimate
