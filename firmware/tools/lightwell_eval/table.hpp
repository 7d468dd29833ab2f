// The rows as text for people and as JSON for programs.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tools/lightwell_eval/front.hpp"
#include "tools/lightwell_eval/marker_rows.hpp"

namespace lightwell::eval {

/// What the numbers of this run stand beside.
struct Run {
  std::vector<std::string> scenes;
  double memcpy_gb_per_s = 0;  ///< Of the default camera's bracket.
  bool quick = false;
};

/// A Markdown table, what its columns mean, and which named settings are off their front.
[[nodiscard]] std::string table_of(std::span<const Row> rows, const Run& run);

/// One object: run and rows, every scene's outcome included, and those of a marker under a key of their own where there
/// are any. What was not measured is null, what is infinite too.
[[nodiscard]] std::string json_of(std::span<const Row> rows, const Run& run, std::span<const MarkerRow> marker = {});

}  // namespace lightwell::eval
