// Chart of the rows: error over time and error over bytes, with labelled points and Pareto fronts; below, those of a
// marker.
#pragma once

#include <span>

#include "tools/lightwell_eval/drawing.hpp"
#include "tools/lightwell_eval/marker_rows.hpp"
#include "tools/lightwell_eval/table.hpp"

namespace lightwell::eval {

[[nodiscard]] Chart pareto_chart(std::span<const Row> rows, const Run& run, std::span<const MarkerRow> marker = {});

}  // namespace lightwell::eval
