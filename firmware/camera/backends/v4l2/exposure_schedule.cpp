#include "camera/backends/v4l2/exposure_schedule.hpp"

#include <algorithm>
#include <cmath>

#include "imaging/frame.hpp"

namespace lightwell::v4l2 {
namespace {

/// Mean and range of the levels before or after a step.
struct Plateau {
  double mean = 0, spread = 0;
};

Plateau plateau_of(std::span<const Level> levels) {
  double sum = 0, least = levels.front().level, most = least;
  for (const Level& l : levels) {
    sum += l.level;
    least = std::min(least, l.level);
    most = std::max(most, l.level);
  }
  return {sum / static_cast<double>(levels.size()), most - least};
}

}  // namespace

ExposureSchedule::ExposureSchedule(int bracket, int delay)
    : bracket_(std::clamp(bracket, 1, kMaxBracket)), delay_(std::clamp(delay, 1, kMaxDelay)) {}

void ExposureSchedule::restart() { count_ = 0; }

std::optional<ExposureSchedule::Write> ExposureSchedule::due(std::uint64_t newest) const {
  if (bracket_ == 1) return std::nullopt;
  const std::uint64_t from = newest + static_cast<std::uint64_t>(delay_);
  if (count_ > 0 && changes_[(count_ - 1) % changes_.size()].from >= from) return std::nullopt;
  return Write{from, static_cast<int>(from % static_cast<std::uint64_t>(bracket_))};
}

void ExposureSchedule::written(const Write& write, Outcome outcome) {
  changes_[count_ % changes_.size()] = {write.from, outcome == Outcome::in_time ? write.index : kUnknown};
  ++count_;
}

std::optional<int> ExposureSchedule::index_of(std::uint64_t sequence) const {
  if (bracket_ == 1) return 0;
  const std::size_t kept = std::min(count_, changes_.size());
  for (std::size_t back = 1; back <= kept; ++back) {
    const Change& change = changes_[(count_ - back) % changes_.size()];
    if (change.from > sequence) continue;
    const int own = static_cast<int>(sequence % static_cast<std::uint64_t>(bracket_));
    return change.index == own ? std::optional(own) : std::nullopt;
  }
  return std::nullopt;
}

std::optional<int> delay_of_step(std::span<const Level> levels, std::uint64_t set_at) {
  constexpr std::size_t kBefore = 3, kAfter = 6, kLast = 3;
  // Smaller changes may be caused by the scene or by noise.
  constexpr double kMinStep = 0.01, kMinRelativeStep = 0.1, kTimesTheSpread = 4;
  // Largest distance of a frame from its plateau, as a fraction of the step: a frame in the middle has a mixed
  // exposure.
  constexpr double kMaxPlateauError = 0.25;

  const auto first_after =
      std::ranges::find_if(levels, [set_at](const Level& l) { return l.sequence > set_at; }) - levels.begin();
  const std::span<const Level> before = levels.first(static_cast<std::size_t>(first_after));
  const std::span<const Level> after = levels.subspan(static_cast<std::size_t>(first_after));
  if (before.size() < kBefore || after.size() < kAfter) return std::nullopt;
  for (const Level& l : levels)
    if (!std::isfinite(l.level)) return std::nullopt;

  const Plateau low = plateau_of(before), high = plateau_of(after.last(kLast));
  const double step = high.mean - low.mean, size = std::abs(step);
  if (size < kMinStep || size < kMinRelativeStep * std::max(low.mean, high.mean) ||
      size < kTimesTheSpread * std::max(low.spread, high.spread))
    return std::nullopt;

  const Level* last_old = &before.back();
  for (std::size_t i = 0; i < after.size(); ++i) {
    const double share = (after[i].level - low.mean) / step;
    if (std::abs(share) <= kMaxPlateauError) {
      last_old = &after[i];
      continue;
    }
    for (const Level& l : after.subspan(i))
      if (std::abs((l.level - low.mean) / step - 1) > kMaxPlateauError) return std::nullopt;
    if (after[i].sequence != last_old->sequence + 1) return std::nullopt;
    const std::uint64_t delay = after[i].sequence - set_at;
    return delay <= static_cast<std::uint64_t>(ExposureSchedule::kMaxDelay) ? std::optional(static_cast<int>(delay))
                                                                            : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace lightwell::v4l2
