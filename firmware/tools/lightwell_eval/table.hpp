// Rows of the table: medians over the scenes, Pareto front, Markdown and JSON.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "tools/lightwell_eval/marker_rows.hpp"
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
  double bound = 0;            ///< Median of the finite error bounds; 0 if there is none.
  double unbounded_share = 0;  ///< Share of scenes whose descriptor has no error bound.

  bool on_front = false;  ///< Not dominated by a row of the same camera and sensor.

  /// The bound; infinite if half of the scenes or more have none.
  [[nodiscard]] double bound_or_infinity() const {
    return unbounded_share < 0.5 ? bound : std::numeric_limits<double>::infinity();
  }
};

/// Computes the medians and worst values from the scenes, of which there is at least one. `memcpy_seconds`: of a
/// bracket of the row's size.
void summarise(Row& row, double memcpy_seconds);

/// Ratios below which a time (which varies between runs) or an error is clearly less than another.
inline constexpr double kClearTime = 0.95, kClearError = 0.98;
/// The ratio for times of rows with the same results, if no instructions were counted. Such rows nearly always do the
/// same work; on a shared machine their times differ by up to 25 %.
inline constexpr double kClearTimeSameResults = 0.7;

/// Sets on_front of the rows that no row of the same camera and sensor dominates. The objectives are time, bytes,
/// median error and median bound: a row dominates another if it is clearly less in one of them and not clearly more in
/// any. Differences of less than 5 % in time (the variation between runs) or 2 % in the others are ignored; so are
/// differences in time if the instruction counts are equal. Without instruction counts, times of rows with the same
/// results differ clearly only below the ratio kClearTimeSameResults.
void mark_front(std::span<Row> rows);

/// Properties of the whole run.
struct Run {
  std::vector<std::string> scenes;
  double memcpy_gb_per_s = 0;  ///< For a bracket of the default camera.
  bool quick = false;
};

/// A Markdown table with an explanation of its columns, and the named settings that are not on their front.
[[nodiscard]] std::string table_of(std::span<const Row> rows, const Run& run);

/// One object: the run, the rows with the outcome of every scene, and the rows of a marker, if any, under the key
/// "marker". Missing values are null.
[[nodiscard]] nlohmann::ordered_json json_of(std::span<const Row> rows, const Run& run,
                                             std::span<const MarkerRow> marker = {});

/// A share in percent with a suitable number of decimals: 0.0123 is "1.23".
[[nodiscard]] std::string percent(double share);

/// One text per column.
using TableLine = std::vector<std::string>;
/// A Markdown table with padded columns. The first line is the header; the first `left` columns and the last one are
/// left-aligned, the others right-aligned.
[[nodiscard]] std::string markdown_table(std::span<const TableLine> lines, std::size_t left);

}  // namespace lightwell::eval
