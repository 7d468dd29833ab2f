// Rows of the tables: medians over the scenes, Pareto front, Markdown and JSON.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <lightwell/result.hpp>

#include "tools/lightwell_eval/measure.hpp"

namespace lightwell::eval {

/// A case of the marker estimator, from tests/measure/measure_marker_trade: medians over the answered frames.
struct MarkerRow {
  std::string what;  ///< Name of the case.
  /// What the case varies; determines its colour in the chart. "setting": the default; "decimation": of the region
  /// where the body is tracked; "search": decimation of a search of the whole picture; "faces": maximum number of
  /// sampled faces; "order": maximum number of lights, use of the table beneath the body.
  std::string parameter = "setting";
  int width = 0, height = 0;  ///< Of a picture, the same in all rows.
  /// Duration of a tracked frame and of the first frame, ms; duration of a tracked frame divided by a memcpy of it.
  std::optional<double> ms, ms_first, memcpy_ratio;
  std::optional<double> rms, worst_rms;  ///< Relative irradiance error over normals within 60 degrees of the camera.
  /// Direction error of the strongest light: median, and worst of the frames that are not flagged.
  std::optional<double> direction_deg, worst_direction_deg;
  double flagged = 0, unanswered = 0;     ///< Shares of all frames.
  bool on_front = false;                  ///< See mark_front().
  std::vector<std::string> dominated_by;  ///< Names of the rows that dominate it.
};

/// Reads a file with one JSON object per line with exactly the fields above except the last two; "knob" is the name of
/// the parameter, null a missing value. Blank lines are ignored. not_found: the file cannot be opened; data_loss, with
/// file and line: no such object, a field that is missing, unknown, repeated or of another type, a negative number, a
/// time or an error of 0, a share above 1, a different picture size, a repeated name; or no rows at all.
[[nodiscard]] Result<std::vector<MarkerRow>> read_marker_rows(const std::string& path);

/// Sets on_front and dominated_by as mark_front() of Row does. The objectives are time, median error, worst error and
/// the share of flagged or unanswered frames. Rows with a time and an error dominate those without.
void mark_front(std::span<MarkerRow> rows);

/// A Markdown table with an explanation of its columns, and the rows that dominate the default.
[[nodiscard]] std::string marker_table_of(std::span<const MarkerRow> rows);

/// A list of the rows with all fields.
[[nodiscard]] nlohmann::ordered_json json_of(std::span<const MarkerRow> rows);

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

/// Computes the medians and worst values of one or more scenes. `memcpy_seconds`: of a bracket of the row's size.
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

/// One object: the run, the rows with the outcome of every scene, the rows of a marker as "marker", if any.
[[nodiscard]] nlohmann::ordered_json json_of(std::span<const Row> rows, const Run& run,
                                             std::span<const MarkerRow> marker = {});

/// A share in percent with a suitable number of decimals: 0.0123 is "1.23".
[[nodiscard]] std::string percent(double share);

/// One text per column.
using TableLine = std::vector<std::string>;
/// A Markdown table. The first line is the header; the first `left` columns and the last are left-aligned.
[[nodiscard]] std::string markdown_table(std::span<const TableLine> lines, std::size_t left);

}  // namespace lightwell::eval
