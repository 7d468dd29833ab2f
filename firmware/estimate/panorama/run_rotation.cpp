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

RunRotation::RunRotation(const CodePass& pass, const BlockLayout& layout, const CellGrid& grid)
    : pass_(pass), grid_(grid), run_of_block_(layout.size(), kNoRun) {
  runs_.resize(pass.weights().run_count());
  for (int lens = 0; lens < layout.lens_count(); ++lens) {
    for (int row = 0; row < pass.weights().row_count(lens); ++row) {
      const std::size_t first = layout.block_of(lens, 0, row * layout.edge());
      std::uint32_t within = 0;
      for (const WeightRun& run : pass.weights().runs(lens, row)) {
        const Run at{first + static_cast<std::size_t>(run.first), first + static_cast<std::size_t>(run.end),
                     static_cast<std::uint32_t>(row + lens) + 3 * within++};
        runs_[run.number] = at;
        for (std::size_t block = at.begin; block < at.end; ++block)
          run_of_block_[block] = static_cast<std::uint32_t>(run.number);
      }
    }
  }
  read_.resize(runs_.size());
  watched_.resize(runs_.size());
}

std::span<const std::uint8_t> RunRotation::begin_frame(int interleave, ProbeTime time) {
  const std::int64_t since = (time - last_).ns;
  all_ = !started_ || refresh_ || interleave != interleave_ || since <= 0 || since > kMaxPause.ns;
  if (interleave != interleave_) {
    projections_.resize(runs_.size());
    centroid_offsets_.resize(runs_.size());
    stale_.assign(static_cast<std::size_t>(interleave), 0);
    interleave_ = interleave;
    started_ = false;
  }
  if (!started_) {
    total_ = {};
    for (auto& of_run : projections_) of_run = {};
  }
  last_ = time;
  group_ = (group_ + 1) % static_cast<std::uint32_t>(interleave);
  difference_ = {};
  difference_noise_ = 0;
  for (std::size_t run = 0; run < runs_.size(); ++run)
    read_[run] = all_ || watched_[run] != 0 || runs_[run].position % static_cast<std::uint32_t>(interleave) == group_;
  // The noise of the last reading; that of this one is about the same.
  for (std::size_t run = 0; run < runs_.size(); ++run)
    if (runs_[run].position % static_cast<std::uint32_t>(interleave) == group_)
      difference_noise_ += 2 * pass_.errors(run).noise;
  return read_;
}

void RunRotation::set(std::size_t run, std::span<const CellSum> sums,
                      std::span<const CellGrid::CentroidOverride> overrides, double centroid_offset) {
  CellGrid::Totals light{};
  grid_.add(runs_[run].begin, runs_[run].end, sums, overrides, light);
  const bool of_group = runs_[run].position % static_cast<std::uint32_t>(interleave_) == group_;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < kRowCount; ++i) {
      float& kept = projections_[run][k][i];
      const auto now = static_cast<float>(light[k][i]);
      const double change = static_cast<double>(now) - static_cast<double>(kept);
      total_[k][i] += change;
      if (of_group) difference_[k][i] += change;
      kept = now;
    }
  }
  centroid_offsets_[run] = centroid_offset;
}

double RunRotation::change_of(const CellGrid::Totals& difference, double noise) {
  Projection change;
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) change.c[i][k] = difference[k][i];
  const IrradianceRms irradiance = irradiance_rms(change);
  const double largest = std::max(irradiance.plain, irradiance.weighted);
  return largest > kNoiseSigmas * noise_rms({.noise = noise}) ? largest : 0;
}

void RunRotation::project(Projection& out) {
  grid_.fit(total_, out);
  const double change = started_ ? kGroupMargin * change_of(difference_, difference_noise_) : 0;
  started_ = true;
  for (double& stale : stale_) stale = all_ ? 0 : std::max(stale, change);
  stale_[group_] = 0;
  const IrradianceRms scene = irradiance_rms(out);
  const double limit = kMaxStale * std::min(scene.plain, scene.weighted);
  // While all is read, the group's change is that of one frame.
  refresh_ = (all_ ? change * interleave_ : stale()) > limit;
}

double RunRotation::centroid_offset() const {
  return std::accumulate(centroid_offsets_.begin(), centroid_offsets_.end(), 0.0);
}

double RunRotation::stale() const { return std::accumulate(stale_.begin(), stale_.end(), 0.0); }

void RunRotation::watch(std::span<const std::uint32_t> blocks) {
  std::ranges::fill(watched_, std::uint8_t{0});
  for (const std::uint32_t block : blocks)
    if (run_of_block_[block] != kNoRun) watched_[run_of_block_[block]] = 1;
}

}  // namespace lightwell::estimate
