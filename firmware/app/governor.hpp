// Chooses the estimator's setting (fast, balanced, exact) so that the time of an estimate stays within a budget.
//
// Lowers the setting when estimates are late: two in succession by more than half the budget, three of four, or more
// than 5 % in the long run. A single late estimate, which a scheduler can cause, changes nothing.
//
// Raises the setting when the richer one is predicted to fit: the 30th smallest of the last 32 durations, times the
// cost of the step, is below 90 % of the budget for a back-off number of estimates in a row. The cost of a step (ratio
// of durations) is measured when the setting is raised. The back-off grows by a factor of 4 when a raise fails in fewer
// than 8 estimates, by 2 when it fails in fewer than 900, and by 2 after another drop by one step if the richer setting
// is predicted to fit again 8 estimates later; it shrinks by 4 after a long stable period. The learnt cost decays with
// a half-life of 200 back-offs, because the scene may have changed: so failed raises are repeated ever more rarely and
// the setting does not oscillate.
//
// There is no clock: time is counted in estimates. Each step has its own cost and back-off.
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
  /// `budget_ms`: ms, or 0 for no budget: the setting is then always `richest`.
  Governor(double budget_ms, Setting richest);

  /// The setting for the next estimate; never richer than `richest`.
  [[nodiscard]] Setting setting() const { return setting_; }
  /// Records the duration of one estimate at setting(), including encoding.
  void record_duration(double ms);
  /// Discards the learnt costs after a reconfiguration of the estimator. If `richest` differs, it is used at once.
  void restart(Setting richest);

  struct Counts {
    std::uint64_t moves = 0;         ///< Changes of the setting.
    std::uint64_t late = 0;          ///< Estimates that took longer than the budget.
    std::uint64_t late_at_fast = 0;  ///< Late estimates at the cheapest setting.
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }
  /// Whether estimates were late at the cheapest setting, too, by the criterion for lowering. Kept until restart().
  [[nodiscard]] bool exceeds_budget_at_fast() const { return exceeds_budget_at_fast_; }
  /// Upper median duration of the latest estimates at this setting, ms; 0 before the first.
  [[nodiscard]] double typical_ms() const;

 private:
  static constexpr std::size_t kHistory = 32;

  [[nodiscard]] bool must_decrease() const;
  [[nodiscard]] bool may_increase();
  void decrease_setting();
  void move_to(Setting setting);
  void update_step_after_move();
  /// The step from one setting to the next richer one.
  struct Step {
    double cost = 1;            ///< Estimated ratio of the durations, richer / cheaper.
    std::uint64_t backoff = 0;  ///< Number of estimates for which the richer setting must be predicted to fit.
  };
  static void increase_backoff(Step& step, std::uint64_t factor);
  [[nodiscard]] Step& upper_step() { return steps_[static_cast<std::size_t>(setting_) - 1]; }
  [[nodiscard]] Step& lower_step() { return steps_[static_cast<std::size_t>(setting_) - 2]; }
  [[nodiscard]] std::size_t history_size() const;
  /// Duration of the estimate `frames` ago, ms; 0 is the latest.
  [[nodiscard]] double duration_at(std::size_t frames) const;
  /// The recorded durations at this setting in ascending order.
  [[nodiscard]] std::span<const double> sorted() const;

  double budget_ms_;
  Setting richest_, setting_;
  Counts counts_;
  bool exceeds_budget_at_fast_ = false;

  std::array<double, kHistory> durations_{};
  mutable std::array<double, kHistory> sorted_{};
  std::uint64_t since_move_ = 0;  ///< Estimates at this setting.
  double late_share_ = 0;         ///< Share of late estimates, exponential moving average.

  std::array<Step, kSettings.size() - 1> steps_;
  std::uint64_t fitting_estimates_ = 0;  ///< Estimates in a row for which the richer setting was predicted to fit.
  bool increased_ = false;               ///< The last move was a raise that is not yet confirmed.
  bool reverted_ = false;                ///< The last move reverted a raise at once.
  bool decreased_ = false;               ///< The last move was one step down without a preceding raise.
  double lower_ms_ = 0;                  ///< Median duration of the cheaper setting before the raise.
  double upper_ms_ = 0;                  ///< Median duration of the richer setting before the drop.
};

}  // namespace lightwell
