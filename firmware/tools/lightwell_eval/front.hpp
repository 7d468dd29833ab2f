// Rows of the table, and which of them no other beats.
#pragma once

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

  bool on_time_front = false, on_bytes_front = false;  ///< Among the case's rivals.
};

[[nodiscard]] double median(std::vector<double> values);

/// Fills what is derived from the scenes. `memcpy_seconds` is of the row's bracket.
void summarise(Row& row, double memcpy_seconds);

/// Marks the rows that none of their rivals beats: no clearly larger median error (2 %) for clearly less time (5 %, by which
/// the same program differs from run to run) or fewer bytes, or a clearly smaller error for no more.
void mark_fronts(std::span<Row> rows);

}  // namespace lightwell::eval
