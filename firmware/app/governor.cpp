#include "app/governor.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell {
namespace {

/// Late by more than this, twice in succession, is load and no accident.
constexpr double kFarLate = 1.5;
/// Share of late estimates that is borne in the long run, and over how many estimates it is watched.
constexpr double kLateShare = 0.05, kLateMemory = 256;
/// A prediction must leave so much of the budget: noise, and what the prediction gets wrong.
constexpr double kRoom = 0.9;
/// A guess at what the steps from fast to balanced and from there to exact cost, until they are measured: on the high
/// side of the 1.0 to 1.3 and 1.1 to 1.4 of lightwell-eval --pareto, as many lights make exact dearer.
constexpr double kUsualSteps[] = {1.2, 1.8};
constexpr double kLargestStep = 64;
constexpr std::uint64_t kFirstPatience = 30, kMostPatience = 30 * 256, kPatienceFactor = 4;
/// Half-life of what is known of a step, in patiences.
constexpr double kFading = 200;
/// A climb that held for so many estimates was right.
constexpr std::uint64_t kProved = 900;
/// It forgives former falls when it has held for so many patiences.
constexpr std::uint64_t kForgiving = 100;
/// Estimates after a move from which a step is learnt.
constexpr std::uint64_t kLesson = 8;

double step_between(double cheaper_ms, double richer_ms, double least) {
  return cheaper_ms > 0 ? std::clamp(richer_ms / cheaper_ms, least, kLargestStep) : least;
}

}  // namespace

Governor::Governor(double budget_ms, Setting richest) : budget_ms_(budget_ms), richest_(richest), setting_(richest) {
  restart(richest);
}

void Governor::restart(Setting richest) {
  if (richest != richest_) setting_ = richest;
  richest_ = richest;
  since_move_ = calm_ = 0;
  late_share_ = 0;
  for (std::size_t i = 0; i < steps_.size(); ++i) steps_[i] = {kUsualSteps[i], kFirstPatience};
  climbed_ = fell_back_ = fell_ = fast_is_late_ = false;
}

void Governor::took(double ms) {
  if (!(budget_ms_ > 0)) return;
  took_[since_move_ % kRemembered] = ms;
  ++since_move_;
  const bool late = ms > budget_ms_;
  late_share_ += ((late ? 1.0 : 0.0) - late_share_) / kLateMemory;
  if (late) {
    ++counts_.late;
    if (setting_ == Setting::fast) ++counts_.late_at_fast;
  }
  if (since_move_ == kLesson) learn();
  if (since_move_ % kProved == 0 && setting_ != Setting::fast) {
    climbed_ = false;
    std::uint64_t& patience = step_down().patience;
    if (since_move_ >= kForgiving * patience) patience = std::max(kFirstPatience, patience / kPatienceFactor);
  }
  if (setting_ < richest_) {
    Step& step = step_up();
    step.cost = 1 + (step.cost - 1) * std::exp2(-1 / (kFading * static_cast<double>(step.patience)));
  }

  if (must_fall()) {
    if (setting_ == Setting::fast)
      fast_is_late_ = true;
    else
      fall();
  } else if (may_climb()) {
    before_ms_ = typical_ms();
    move_to(static_cast<Setting>(static_cast<int>(setting_) + 1));
    climbed_ = true;
    fell_back_ = false;
  }
}

bool Governor::must_fall() const {
  const std::size_t n = remembered();
  if (n >= 2 && std::min(ago(0), ago(1)) > kFarLate * budget_ms_) return true;
  int late = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(n, 4); ++i) late += ago(i) > budget_ms_ ? 1 : 0;
  return late >= 3 || late_share_ > kLateShare;
}

bool Governor::may_climb() {
  const bool fits = setting_ < richest_ && remembered() == kRemembered &&
                    sorted()[kRemembered - 3] * step_up().cost <= kRoom * budget_ms_;
  calm_ = fits ? calm_ + 1 : 0;
  return fits && calm_ >= step_up().patience;
}

void Governor::fall() {
  const std::size_t n = remembered();
  double ms = sorted()[n - 1 - n / 16];
  if (ago(0) > budget_ms_ && ago(1) > budget_ms_) ms = std::min(ms, std::max(ago(0), ago(1)));
  int to = static_cast<int>(setting_);
  do {
    --to;
    ms /= steps_[static_cast<std::size_t>(to) - 1].cost;
  } while (to > static_cast<int>(Setting::fast) && ms > kRoom * budget_ms_);

  // A climb that fell at once was a mistake; one that held for a while met another load, and may be tried sooner.
  const bool at_once = since_move_ < kLesson;
  if (climbed_) lose_patience(step_down(), at_once ? kPatienceFactor : kPatienceFactor / 2);
  const bool one_step = to + 1 == static_cast<int>(setting_);
  fell_back_ = climbed_ && at_once && one_step;
  fell_ = !climbed_ && one_step;
  richer_ms_ = typical_ms();
  move_to(static_cast<Setting>(to));
  climbed_ = false;
  if (fell_back_) step_up().cost = step_between(before_ms_, richer_ms_, step_up().cost);
}

/// A step is the ratio of what was measured on its two sides at about the same time. Falls that load forced say nothing
/// of it: the load is in one of the two alone.
void Governor::learn() {
  if (climbed_) {
    step_down().cost = step_between(before_ms_, typical_ms(), 1);
  } else if (fell_back_) {
    // Where the cheaper setting takes longer now than before the climb, load rose meanwhile and is no part of the step.
    step_up().cost = step_between(std::max(before_ms_, typical_ms()), richer_ms_, 1);
  } else if (fell_ && typical_ms() * step_up().cost <= kRoom * budget_ms_) {
    // The richer setting would fit already: it was not load that rose, but noise that reaches over the budget from time
    // to time. It will do so again.
    lose_patience(step_up(), kPatienceFactor / 2);
  }
  fell_back_ = fell_ = false;
}

void Governor::lose_patience(Step& step, std::uint64_t factor) {
  step.patience = std::min(kMostPatience, factor * step.patience);
}

void Governor::move_to(Setting setting) {
  setting_ = setting;
  ++counts_.moves;
  since_move_ = calm_ = 0;
  late_share_ = 0;
}

std::size_t Governor::remembered() const {
  return static_cast<std::size_t>(std::min<std::uint64_t>(since_move_, kRemembered));
}

double Governor::ago(std::size_t frames) const { return took_[(since_move_ - 1 - frames) % kRemembered]; }

std::span<const double> Governor::sorted() const {
  const std::size_t n = remembered();
  std::copy_n(took_.begin(), n, sorted_.begin());
  std::sort(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(n));
  return {sorted_.data(), n};
}

double Governor::typical_ms() const {
  const std::span<const double> all = sorted();
  return all.empty() ? 0 : all[all.size() / 2];
}

}  // namespace lightwell
