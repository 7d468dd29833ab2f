// Which setting comes next, so that estimates keep to a budget of time: along the measured front, cheaper under load,
// richer again when there is room.
//
// It falls when estimates are late: after two in succession by more than half the budget, when three of four are late,
// or when more than 5 % are in the long run. One late estimate alone moves nothing: that is what a scheduler does.
//
// It climbs when the richer setting is predicted to fit: what 30 of the last 32 estimates took, times what the step
// costs, below 90 % of the budget for as many frames as it has patience. What a step costs is learnt from climbs. Each
// fall that load does not explain makes it more patient: four times where a climb fell at once, twice otherwise;
// holding for long makes it less so. What it knows of a step fades over 200 patiences, for the light may have changed:
// so it tries again, ever more seldom, and does not swing.
//
// It has no clock. Time is counted in estimates. Cost and patience are each step's own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <lightwell/descriptor.hpp>

namespace lightwell {

/// One thread. Allocates nothing.
class Governor {
 public:
  /// `budget_ms` > 0, or 0: none, then the setting is `richest` for good.
  Governor(double budget_ms, Setting richest);

  /// With which the next estimate is to be made: never richer than `richest`.
  [[nodiscard]] Setting setting() const { return setting_; }
  /// How long one estimate at setting() took, to its encoded bytes.
  void record_duration(double ms);
  /// The estimator has been configured anew, so that what was learnt no longer holds. Another `richest` is tried at
  /// once.
  void restart(Setting richest);

  struct Counts {
    std::uint64_t moves = 0;         ///< Up or down.
    std::uint64_t late = 0;          ///< Estimates that took longer than the budget.
    std::uint64_t late_at_fast = 0;  ///< Of those, the ones at the cheapest setting: nothing was left to do.
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }
  /// Estimates at the cheapest setting are late as well, and not only now and then. Stays so until restart().
  [[nodiscard]] bool exceeds_budget_at_fast() const { return exceeds_budget_at_fast_; }
  /// Median of the latest estimates at this setting, ms; 0 before the first.
  [[nodiscard]] double typical_ms() const;

 private:
  static constexpr std::size_t kHistory = 32;

  [[nodiscard]] bool must_decrease() const;
  [[nodiscard]] bool may_increase();
  void decrease_setting();
  void move_to(Setting setting);
  void update_step_cost();
  /// From one setting to the next richer one.
  struct Step {
    double cost = 1;             ///< Of the richer one relative to the cheaper one, as believed.
    std::uint64_t backoff = 0;  ///< Estimates for which the richer one must be predicted to fit.
  };
  static void increase_backoff(Step& step, std::uint64_t factor);
  [[nodiscard]] Step& upper_step() { return steps_[static_cast<std::size_t>(setting_) - 1]; }
  [[nodiscard]] Step& lower_step() { return steps_[static_cast<std::size_t>(setting_) - 2]; }
  [[nodiscard]] std::size_t history_size() const;
  /// The latest is 0.
  [[nodiscard]] double duration_at(std::size_t frames) const;
  /// The estimates of this setting that are remembered, from small to large.
  [[nodiscard]] std::span<const double> sorted() const;

  double budget_ms_;
  Setting richest_, setting_;
  Counts counts_;
  bool exceeds_budget_at_fast_ = false;

  std::array<double, kHistory> durations_{};
  mutable std::array<double, kHistory> sorted_{};
  std::uint64_t since_move_ = 0;  ///< Estimates at this setting.
  double late_share_ = 0;         ///< Of them, the recent ones weighing most.

  std::array<Step, kSettings.size() - 1> steps_;
  std::uint64_t fitting_estimates_ = 0;  ///< Estimates in a row after which the richer setting was predicted to fit.
  bool increased_ = false;    ///< The last move was up, and has not proved itself yet.
  bool reverted_ = false;  ///< The last move took back a climb at once.
  bool decreased_ = false;       ///< The last move was one step down from where it had stood long.
  double lower_ms_ = 0;    ///< What the cheaper setting typically took before the climb.
  double upper_ms_ = 0;    ///< What the richer one typically took before the fall back.
};

}  // namespace lightwell
