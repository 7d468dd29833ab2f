#include "app/governor.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell {
namespace {

/// Duration relative to the budget; two in succession above it count as overload.
constexpr double kOverloadRatio = 1.5;
/// Largest tolerated share of late estimates in the long run, and the time constant of its average in estimates.
constexpr double kLateShare = 0.05, kLateMemory = 256;
/// Share of the budget that a prediction may use; the rest allows for noise and errors of the prediction.
constexpr double kBudgetShare = 0.9;
/// Initial costs of the steps from fast to balanced and from balanced to exact. lightwell-eval --pareto measures 1.0 to
/// 1.3 and 1.1 to 1.4; these are higher, because many lights make exact more expensive.
constexpr double kInitialStepCosts[] = {1.2, 1.8};
constexpr double kMaxStepCost = 64;
constexpr std::uint64_t kInitialBackoff = 30, kMaxBackoff = 30 * 256, kBackoffFactor = 4;
/// Half-life of the learnt cost of a step, in back-offs.
constexpr double kStepCostHalfLife = 200;
/// Number of estimates after which a raise is confirmed.
constexpr std::uint64_t kStableEstimates = 900;
/// Number of back-offs at one setting after which the back-off is reduced.
constexpr std::uint64_t kBackoffReset = 100;
/// Number of estimates after a move from which the cost of the step is computed.
constexpr std::uint64_t kLearningWindow = 8;

double step_between(double cheaper_ms, double richer_ms, double least) {
  return cheaper_ms > 0 ? std::clamp(richer_ms / cheaper_ms, least, kMaxStepCost) : least;
}

}  // namespace

Governor::Governor(double budget_ms, Setting richest) : budget_ms_(budget_ms), richest_(richest), setting_(richest) {
  restart(richest);
}

void Governor::restart(Setting richest) {
  if (richest != richest_) setting_ = richest;
  richest_ = richest;
  since_move_ = fitting_estimates_ = 0;
  late_share_ = 0;
  for (std::size_t i = 0; i < steps_.size(); ++i) steps_[i] = {kInitialStepCosts[i], kInitialBackoff};
  increased_ = reverted_ = decreased_ = exceeds_budget_at_fast_ = false;
}

void Governor::record_duration(double ms) {
  if (!(budget_ms_ > 0)) return;
  durations_[since_move_ % kHistory] = ms;
  ++since_move_;
  const bool late = ms > budget_ms_;
  late_share_ += ((late ? 1.0 : 0.0) - late_share_) / kLateMemory;
  if (late) {
    ++counts_.late;
    if (setting_ == Setting::fast) ++counts_.late_at_fast;
  }
  if (since_move_ == kLearningWindow) update_step_after_move();
  if (since_move_ % kStableEstimates == 0 && setting_ != Setting::fast) {
    increased_ = false;
    std::uint64_t& backoff = lower_step().backoff;
    if (since_move_ >= kBackoffReset * backoff) backoff = std::max(kInitialBackoff, backoff / kBackoffFactor);
  }
  if (setting_ < richest_) {
    Step& step = upper_step();
    step.cost = 1 + (step.cost - 1) * std::exp2(-1 / (kStepCostHalfLife * static_cast<double>(step.backoff)));
  }

  if (must_decrease()) {
    if (setting_ == Setting::fast)
      exceeds_budget_at_fast_ = true;
    else
      decrease_setting();
  } else if (may_increase()) {
    lower_ms_ = typical_ms();
    move_to(static_cast<Setting>(static_cast<int>(setting_) + 1));
    increased_ = true;
    reverted_ = false;
  }
}

bool Governor::must_decrease() const {
  const std::size_t n = history_size();
  if (n >= 2 && std::min(duration_at(0), duration_at(1)) > kOverloadRatio * budget_ms_) return true;
  int late = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(n, 4); ++i) late += duration_at(i) > budget_ms_ ? 1 : 0;
  return late >= 3 || late_share_ > kLateShare;
}

bool Governor::may_increase() {
  const bool fits = setting_ < richest_ && history_size() == kHistory &&
                    sorted()[kHistory - 3] * upper_step().cost <= kBudgetShare * budget_ms_;
  fitting_estimates_ = fits ? fitting_estimates_ + 1 : 0;
  return fits && fitting_estimates_ >= upper_step().backoff;
}

void Governor::decrease_setting() {
  const std::size_t n = history_size();
  double ms = sorted()[n - 1 - n / 16];
  if (duration_at(0) > budget_ms_ && duration_at(1) > budget_ms_)
    ms = std::min(ms, std::max(duration_at(0), duration_at(1)));
  int to = static_cast<int>(setting_);
  do {
    --to;
    ms /= steps_[static_cast<std::size_t>(to) - 1].cost;
  } while (to > static_cast<int>(Setting::fast) && ms > kBudgetShare * budget_ms_);

  // A raise that failed at once was wrong. One that held for a while failed by a change of load: retry it sooner.
  const bool at_once = since_move_ < kLearningWindow;
  if (increased_) increase_backoff(lower_step(), at_once ? kBackoffFactor : kBackoffFactor / 2);
  const bool one_step = to + 1 == static_cast<int>(setting_);
  reverted_ = increased_ && at_once && one_step;
  decreased_ = !increased_ && one_step;
  upper_ms_ = typical_ms();
  move_to(static_cast<Setting>(to));
  increased_ = false;
  if (reverted_) upper_step().cost = step_between(lower_ms_, upper_ms_, upper_step().cost);
}

/// Learns from the last move, kLearningWindow estimates after it. After a raise, and after a raise that was reverted at
/// once, the cost of the step is the ratio of the durations at its two settings, measured shortly before and after the
/// move. Another drop may only increase the back-off: load may have caused it, and is in only one of the two durations.
void Governor::update_step_after_move() {
  if (increased_) {
    lower_step().cost = step_between(lower_ms_, typical_ms(), 1);
  } else if (reverted_) {
    // If the cheaper setting takes longer now than before the raise, the difference is load, not part of the step.
    upper_step().cost = step_between(std::max(lower_ms_, typical_ms()), upper_ms_, 1);
  } else if (decreased_ && typical_ms() * upper_step().cost <= kBudgetShare * budget_ms_) {
    // The richer setting is predicted to fit again: not lasting load but a few late estimates caused the drop. They
    // will occur again, so wait longer before the next raise.
    increase_backoff(upper_step(), kBackoffFactor / 2);
  }
  reverted_ = decreased_ = false;
}

void Governor::increase_backoff(Step& step, std::uint64_t factor) {
  step.backoff = std::min(kMaxBackoff, factor * step.backoff);
}

void Governor::move_to(Setting setting) {
  setting_ = setting;
  ++counts_.moves;
  since_move_ = fitting_estimates_ = 0;
  late_share_ = 0;
}

std::size_t Governor::history_size() const {
  return static_cast<std::size_t>(std::min<std::uint64_t>(since_move_, kHistory));
}

double Governor::duration_at(std::size_t frames) const { return durations_[(since_move_ - 1 - frames) % kHistory]; }

std::span<const double> Governor::sorted() const {
  const std::size_t n = history_size();
  std::copy_n(durations_.begin(), n, sorted_.begin());
  std::sort(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(n));
  return {sorted_.data(), n};
}

double Governor::typical_ms() const {
  const std::span<const double> all = sorted();
  return all.empty() ? 0 : all[all.size() / 2];
}

}  // namespace lightwell
