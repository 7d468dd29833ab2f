// What the marker's knobs cost and give, as tests/measure/measure_marker_trade measured it: rows read, judged and told.
//   MarkerRow, read_marker_rows, mark_front, marker_table_of, marker_json_of
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::eval {

/// What a case varies; a colour in the picture.
enum class MarkerSweepParameter {
  setting,     ///< Nothing: the default.
  decimation,  ///< Of the picture where the body is followed.
  search,      ///< Of the picture where it is looked for.
  faces,       ///< The most that are sampled.
  order,       ///< The most lamps; whether the table tells.
};
[[nodiscard]] std::string_view to_string(MarkerSweepParameter parameter);

/// Medians over frames. What no frame told is missing; a median is of the frames that were answered.
struct MarkerRow {
  std::string what;
  MarkerSweepParameter parameter = MarkerSweepParameter::setting;
  int width = 0, height = 0;  ///< Of a picture, the same in all rows.
  std::optional<double> ms, ms_first,
      memcpy_ratio;  ///< Of a frame that is followed; of the first one; ms beside memcpy of the frame.
  std::optional<double> rms, worst_rms;  ///< Of the irradiance, relative, over normals within 60 degrees of the camera.
  std::optional<double> direction_deg,
      worst_direction_deg;             ///< Of the strongest lamp; the worst of answers that are not flagged.
  double flagged = 0, unanswered = 0;  ///< Shares of all frames.
  bool on_front = false;               ///< See mark_front().
  std::vector<std::string> beaten_by;  ///< Who beats it, by `what`.
};

/// A file of one JSON object a line with exactly the fields above, but for the last two; knob by name, null for what is
/// missing. Blank lines are passed over. not_found where it cannot be read; data_loss names file and line: no such
/// object, a field that is missing, unknown, twice or of another kind, a negative number, a time or an error of 0, a
/// share above 1, pictures of another size, a name twice; or no rows at all.
[[nodiscard]] Result<std::vector<MarkerRow>> read_marker_rows(const std::string& path);

/// Marks the rows that none other beats: with no more of time, median error, worst error and frames that are not surely
/// answered, and clearly less of one of them, as front.hpp has it. A row without time and median is not on the front;
/// those with them beat it.
void mark_front(std::span<MarkerRow> rows);

/// A Markdown table, what its columns mean, and who beats the default where somebody does.
[[nodiscard]] std::string marker_table_of(std::span<const MarkerRow> rows);

/// A list of objects, as they were read, with the last two.
[[nodiscard]] std::string marker_json_of(std::span<const MarkerRow> rows);

}  // namespace lightwell::eval
