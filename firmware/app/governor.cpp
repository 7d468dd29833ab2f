#include "app/governor.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/estimator_config.hpp>

namespace lightwell {
namespace {

/// Value relative to the limit; two in succession above it count as overload.
constexpr double kOverloadRatio = 1.5;
/// Largest tolerated share of estimates above the limit in the long run, and the time constant of its average.
constexpr double kExceededShare = 0.05, kExceededMemory = 256;
/// Share of the limit that a prediction may use; the rest allows for noise and errors of the prediction.
constexpr double kLimitShare = 0.9;
/// Initial ratios of durations of one setting of kSettings to the one before. tests/figures trade_off counts 5 to 10 in
/// the first; a lower number, because a step that fails is cheap, and because it is 1 where frames cannot be
/// interleaved. lightwell-eval --pareto measures 1.0 to 1.3 and 1.1 to 1.4 in the others; these are higher, because
/// many lights make exact more expensive.
constexpr std::array kDurationRatios = {3.0, 1.2, 1.8};
/// Initial ratios of bounds: of interleaved to whole frames at rest, and of a setting of kSettings to the richer one.
constexpr double kInterleavedBound = 1.05;
constexpr std::array kBoundRatios = {1.5, 1.5, 1.5};
constexpr double kMaxRatio = 64;
constexpr std::uint64_t kInitialBackoff = 30, kMaxBackoff = 30 * 256, kBackoffFactor = 4;
/// Half-life of the learnt ratio of a step, in back-offs.
constexpr double kRatioHalfLife = 200;
/// Number of estimates after which a step on is confirmed.
constexpr std::uint64_t kStableEstimates = 900;
/// Number of back-offs at one point after which the back-off is reduced.
constexpr std::uint64_t kBackoffReset = 100;
/// Number of estimates after a move from which the ratio of the step is computed.
constexpr std::uint64_t kLearningWindow = 8;

double ratio_of(double here, double next, double least) {
  return here > 0 ? std::clamp(next / here, least, kMaxRatio) : least;
}

std::size_t index_of(Setting setting) {
  return static_cast<std::size_t>(std::ranges::find(kSettings, setting) - kSettings.begin());
}

}  // namespace

bool is_cheaper(const OperatingPoint& a, const OperatingPoint& b) {
  const auto whole = [](const OperatingPoint& p) { return p.setting != Setting::fastest && p.interleave == 0; };
  return whole(a) != whole(b) ? whole(b) : index_of(a.setting) < index_of(b.setting);
}

Governor::Governor(Governed quantity, double limit, Setting richest) : quantity_(quantity), limit_(limit) {
  restart(richest);
}

void Governor::plan_points(Setting richest) {
  const std::size_t last = index_of(richest);
  count_ = 0;
  const auto add = [this](OperatingPoint point, double ratio) { points_[count_++] = {point, ratio, kInitialBackoff}; };
  if (quantity_ == Governed::duration) {
    for (std::size_t k = 0; k <= last; ++k) add({kSettings[k]}, k < kDurationRatios.size() ? kDurationRatios[k] : 1);
    return;
  }
  // Fast with interleaved frames is fastest.
  add({richest}, kInterleavedBound);
  for (std::size_t k = last; k >= 2; --k) add({kSettings[k], kMaxInterleave}, kBoundRatios[k - 1]);
  if (last >= 1) add({Setting::fastest}, 1);
}

void Governor::restart(Setting richest) {
  const std::size_t at = at_;
  const bool same = richest == richest_;
  richest_ = richest;
  plan_points(richest);
  at_ = same ? at : count_ - 1;
  since_move_ = fitting_estimates_ = 0;
  exceeded_share_ = 0;
  stepped_on_ = reverted_ = stepped_back_ = exceeds_everywhere_ = false;
}

void Governor::record(double value) {
  if (!active() || !std::isfinite(value)) return;
  values_[since_move_ % kHistory] = value;
  ++since_move_;
  const bool exceeds = value > limit_;
  exceeded_share_ += ((exceeds ? 1.0 : 0.0) - exceeded_share_) / kExceededMemory;
  if (exceeds) {
    ++counts_.exceeded;
    if (at_ == 0) ++counts_.exceeded_first;
  }
  if (since_move_ == kLearningWindow) update_step_after_move();
  if (since_move_ % kStableEstimates == 0 && at_ > 0) {
    stepped_on_ = false;
    std::uint64_t& backoff = last_step().backoff;
    if (since_move_ >= kBackoffReset * backoff) backoff = std::max(kInitialBackoff, backoff / kBackoffFactor);
  }
  if (at_ + 1 < count_) {
    Step& step = next_step();
    step.ratio = 1 + (step.ratio - 1) * std::exp2(-1 / (kRatioHalfLife * static_cast<double>(step.backoff)));
  }

  if (must_step_back()) {
    if (at_ == 0)
      exceeds_everywhere_ = true;
    else
      step_back();
  } else if (may_step_on()) {
    before_ = typical();
    move_to(at_ + 1);
    stepped_on_ = true;
    reverted_ = false;
  }
}

bool Governor::must_step_back() const {
  const std::size_t n = history_size();
  if (n >= 2 && std::min(value_at(0), value_at(1)) > kOverloadRatio * limit_) return true;
  int exceeded = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(n, 4); ++i) exceeded += value_at(i) > limit_ ? 1 : 0;
  return exceeded >= 3 || exceeded_share_ > kExceededShare;
}

bool Governor::may_step_on() {
  const bool fits = at_ + 1 < count_ && history_size() == kHistory &&
                    sorted()[kHistory - 3] * next_step().ratio <= kLimitShare * limit_;
  fitting_estimates_ = fits ? fitting_estimates_ + 1 : 0;
  return fits && fitting_estimates_ >= next_step().backoff;
}

void Governor::step_back() {
  const std::size_t n = history_size();
  double value = sorted()[n - 1 - n / 16];
  if (value_at(0) > limit_ && value_at(1) > limit_) value = std::min(value, std::max(value_at(0), value_at(1)));
  // The point before a step on kept the limit.
  std::size_t to = at_;
  do {
    --to;
    value /= points_[to].ratio;
  } while (to > 0 && value > kLimitShare * limit_ && !stepped_on_);

  // A step on that failed at once was wrong. One that held for a while failed by a change of load or of the scene: it
  // is tried sooner.
  const bool at_once = since_move_ < kLearningWindow;
  if (stepped_on_) increase_backoff(last_step(), at_once ? kBackoffFactor : kBackoffFactor / 2);
  const bool one_step = to + 1 == at_;
  reverted_ = stepped_on_ && at_once && one_step;
  stepped_back_ = !stepped_on_ && one_step;
  after_ = typical();
  move_to(to);
  stepped_on_ = false;
  if (reverted_) next_step().ratio = ratio_of(before_, after_, next_step().ratio);
}

/// Learns from the last move, kLearningWindow estimates after it. After a step on, and after one that was reverted at
/// once, the ratio of the step is that of the values at its two points, measured shortly before and after the move.
/// Another step back may only increase the back-off: load may have caused it, and is in only one of the two values.
void Governor::update_step_after_move() {
  if (stepped_on_) {
    last_step().ratio = ratio_of(before_, typical(), 1);
  } else if (reverted_) {
    // If this point has more now than before the step on, the difference is load, not part of the step.
    next_step().ratio = ratio_of(std::max(before_, typical()), after_, 1);
  } else if (stepped_back_ && typical() * next_step().ratio <= kLimitShare * limit_) {
    // The next point is predicted to fit again: not lasting load but a few estimates caused the step back. They will
    // occur again, so wait longer before the next step on.
    increase_backoff(next_step(), kBackoffFactor / 2);
  }
  reverted_ = stepped_back_ = false;
}

void Governor::increase_backoff(Step& step, std::uint64_t factor) {
  step.backoff = std::min(kMaxBackoff, factor * step.backoff);
}

void Governor::move_to(std::size_t point) {
  at_ = point;
  ++counts_.moves;
  since_move_ = fitting_estimates_ = 0;
  exceeded_share_ = 0;
}

std::size_t Governor::history_size() const {
  return static_cast<std::size_t>(std::min<std::uint64_t>(since_move_, kHistory));
}

double Governor::value_at(std::size_t frames) const { return values_[(since_move_ - 1 - frames) % kHistory]; }

std::span<const double> Governor::sorted() const {
  const std::size_t n = history_size();
  std::copy_n(values_.begin(), n, sorted_.begin());
  std::sort(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(n));
  return {sorted_.data(), n};
}

double Governor::typical() const {
  const std::span<const double> all = sorted();
  return all.empty() ? 0 : all[all.size() / 2];
}

}  // namespace lightwell
