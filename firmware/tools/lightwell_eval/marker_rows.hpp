// Cost and accuracy of the marker estimator's parameters, from the output of tests/measure/measure_marker_trade.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <lightwell/result.hpp>

namespace lightwell::eval {

/// Medians over the answered frames; nullopt if there are none.
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

/// Sets on_front and dominated_by as mark_front() of table.hpp. The objectives are time, median error, worst error and
/// the share of flagged or unanswered frames. A row without time or median error is dominated by all rows that have
/// them.
void mark_front(std::span<MarkerRow> rows);

/// A Markdown table with an explanation of its columns, and the rows that dominate the default.
[[nodiscard]] std::string marker_table_of(std::span<const MarkerRow> rows);

/// A list of the rows with all fields.
[[nodiscard]] nlohmann::ordered_json json_of(std::span<const MarkerRow> rows);

}  // namespace lightwell::eval
