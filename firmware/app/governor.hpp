// Moves the estimator along a scale of points of cost against accuracy, so that a quantity stays within a limit: the
// duration of an estimate, or the bound that its descriptor states.
//
//   duration   fastest, fast, balanced, exact: the richest that keeps the time budget
//   bound      exact; then exact, balanced and fast with interleaved frames: the cheapest that keeps the bound
//
// Steps back (towards the point with the least of the quantity) when estimates exceed the limit: two in succession by
// more than half of it, three of four, or more than 5 % in the long run. A single one, which a scheduler or a moving
// person can cause, changes nothing.
//
// Steps on when the next point is predicted to keep the limit: the 30th smallest of the last 32 values, times the ratio
// of the step, is below 90 % of the limit for a back-off number of estimates in a row. The ratio is measured when a
// step is taken. The back-off grows by a factor of 4 when a step on fails in fewer than 8 estimates, by 2 when it fails
// in fewer than 900, and by 2 after another step back by one point if the next point is predicted to keep the limit
// again 8 estimates later; it shrinks by 4 after a long stable period. The learnt ratio decays with a half-life of 200
// back-offs, because the scene may have changed: so failed steps are repeated ever more rarely and the points do not
// oscillate.
//
// There is no clock: time is counted in estimates. Each step has its own ratio and back-off.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <lightwell/descriptor.hpp>

namespace lightwell {

/// A point of cost against accuracy: the estimator's configuration with this setting and interleave.
struct OperatingPoint {
  Setting setting = Setting::balanced;
  int interleave = 0;  ///< At least this; 0: as configured.
  friend bool operator==(const OperatingPoint&, const OperatingPoint&) = default;
};
/// Whether `a` takes less time than `b`: most of the time is spent on pixels, which interleaved frames read less of.
[[nodiscard]] bool is_cheaper(const OperatingPoint& a, const OperatingPoint& b);

enum class Governed : std::uint8_t { duration, bound };

/// One thread. Allocates nothing.
class Governor {
 public:
  /// `limit`: ms (duration), or a relative error (bound); 0 for none: point() then never changes. No point is richer
  /// than `richest`. Starts at `richest` (duration), or at the cheapest point (bound).
  Governor(Governed quantity, double limit, Setting richest);

  [[nodiscard]] bool active() const { return limit_ > 0; }
  /// For the next estimate.
  [[nodiscard]] OperatingPoint point() const { return points_[at_].point; }
  /// Records the quantity of one estimate at point(): its duration including encoding, or its bound. A bound that is
  /// not finite is ignored: the flags give its reason, which no setting changes.
  void record(double value);
  /// Discards what was learnt, after a reconfiguration of the estimator. If `richest` differs, starts again.
  void restart(Setting richest);

  struct Counts {
    std::uint64_t moves = 0;           ///< Changes of the point.
    std::uint64_t exceeded = 0;        ///< Estimates above the limit.
    std::uint64_t exceeded_first = 0;  ///< Of these, at the point with the least of the quantity.
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }
  /// Whether no point keeps the limit, by the criterion for stepping back. Kept until restart().
  [[nodiscard]] bool exceeds_everywhere() const { return exceeds_everywhere_; }
  /// Upper median of the latest values at this point; 0 before the first.
  [[nodiscard]] double typical() const;

 private:
  static constexpr std::size_t kHistory = 32;

  /// A point, and the step to the next one.
  struct Step {
    OperatingPoint point;
    double ratio = 1;           ///< Estimated ratio of the quantity at the next point to that here.
    std::uint64_t backoff = 0;  ///< Number of estimates for which the next point must be predicted to fit.
  };

  void plan_points(Setting richest);
  [[nodiscard]] bool must_step_back() const;
  [[nodiscard]] bool may_step_on();
  void step_back();
  void move_to(std::size_t point);
  void update_step_after_move();
  static void increase_backoff(Step& step, std::uint64_t factor);
  [[nodiscard]] Step& next_step() { return points_[at_]; }
  [[nodiscard]] Step& last_step() { return points_[at_ - 1]; }
  [[nodiscard]] std::size_t history_size() const;
  /// Value of the estimate `frames` ago; 0 is the latest.
  [[nodiscard]] double value_at(std::size_t frames) const;
  /// The recorded values at this point in ascending order.
  [[nodiscard]] std::span<const double> sorted() const;

  Governed quantity_;
  double limit_;
  Setting richest_{};
  std::array<Step, kSettings.size()> points_;  ///< In ascending order of the quantity.
  std::size_t count_ = 0, at_ = 0;             ///< Of points_.
  Counts counts_;
  bool exceeds_everywhere_ = false;

  std::array<double, kHistory> values_{};
  mutable std::array<double, kHistory> sorted_{};
  std::uint64_t since_move_ = 0;  ///< Estimates at this point.
  double exceeded_share_ = 0;     ///< Share of estimates above the limit, exponential moving average.

  std::uint64_t fitting_estimates_ = 0;  ///< Estimates in a row for which the next point was predicted to fit.
  bool stepped_on_ = false;              ///< The last move was a step on that is not yet confirmed.
  bool reverted_ = false;                ///< The last move reverted a step on at once.
  bool stepped_back_ = false;            ///< The last move was one step back without a preceding step on.
  double before_ = 0;                    ///< Median before the step on.
  double after_ = 0;                     ///< Median before the step back.
};

}  // namespace lightwell
