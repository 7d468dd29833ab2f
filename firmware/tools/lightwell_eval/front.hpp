// Rows of the table, and which of them no other beats.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "tools/lightwell_eval/cases.hpp"
#include "tools/lightwell_eval/measure.hpp"

namespace lightwell::eval {

/// One case over all scenes.
struct Row {
  Case setup;
  std::vector<Outcome> scenes;

  // Medians over scenes, and the worst scene.
  double ms = 0, memcpy_ratio = 0, bytes = 0;
  double rms = 0, worst_rms = 0, largest = 0, worst_largest = 0;
  std::optional<double> instructions_per_pixel, light_deg, worst_light_deg;
  std::array<double, kBalls> balls{};
  double bound = 0;            ///< Median of the finite ones; 0 where there is none.
  double unbounded_share = 0;  ///< Scenes whose descriptor says that it cannot bound its error.

  bool on_front = false;  ///< Among the case's rivals.

  /// The bound; infinite where half of the scenes or more have none.
  [[nodiscard]] double promised() const {
    return unbounded_share < 0.5 ? bound : std::numeric_limits<double>::infinity();
  }
};

[[nodiscard]] double median(std::vector<double> values);

/// Fills what is derived from the scenes. `memcpy_seconds` is of the row's bracket.
void summarise(Row& row, double memcpy_seconds);

/// A number is clearly less than another below this share of it: times, which differ from run to run of the same
/// program, and errors.
inline constexpr double kClearTime = 0.95, kClearError = 0.98;
/// The same of times of rows with the same results, which nearly always come of the same work, where no instructions
/// were counted: on a shared machine they were up to 25 % apart.
inline constexpr double kClearTimeSameResults = 0.7;

/// Marks the rows that none of their rivals beats. One beats another that has no more of time, bytes, median error and
/// median bound, and clearly less of one of them. Differences below 5 % of time, by which the same program differs from
/// run to run, or 2 % of the others do not count, nor does time where as many instructions were counted; where
/// none were and all results are the same, times count from kClearTimeSameResults on.
void mark_front(std::span<Row> rows);

}  // namespace lightwell::eval
