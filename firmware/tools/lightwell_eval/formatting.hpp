// Numbers and tables as text.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lightwell::eval {

/// printf into a string of at most 255 characters.
[[gnu::format(printf, 1, 2)]] [[nodiscard]] std::string text(const char* format, ...);

/// A share in percent with a suitable number of decimals: 0.0123 is "1.23".
[[nodiscard]] std::string percent(double share);

/// A JSON number; null if there is no value or it is not finite.
[[nodiscard]] std::string number(double v);
[[nodiscard]] std::string number(const std::optional<double>& v);

/// One text per column.
using TableLine = std::vector<std::string>;
/// A Markdown table with padded columns. The first line is the header; the first `left` columns and the last one are
/// left-aligned, the others right-aligned.
[[nodiscard]] std::string markdown_table(std::span<const TableLine> lines, std::size_t left);

}  // namespace lightwell::eval
