// Numbers and tables as text.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace lightwell::eval {

/// A share in percent with a suitable number of decimals: 0.0123 is "1.23".
[[nodiscard]] std::string percent(double share);

/// One text per column.
using TableLine = std::vector<std::string>;
/// A Markdown table with padded columns. The first line is the header; the first `left` columns and the last one are
/// left-aligned, the others right-aligned.
[[nodiscard]] std::string markdown_table(std::span<const TableLine> lines, std::size_t left);

}  // namespace lightwell::eval
