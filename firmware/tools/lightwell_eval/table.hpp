// The rows as a Markdown table and as JSON.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "tools/lightwell_eval/front.hpp"
#include "tools/lightwell_eval/marker_rows.hpp"

namespace lightwell::eval {

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

}  // namespace lightwell::eval
