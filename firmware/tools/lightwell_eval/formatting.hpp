// Numbers and tables as text.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lightwell::eval {

/// printf into a string of at most 255 characters.
[[gnu::format(printf, 1, 2)]] [[nodiscard]] std::string text(const char* format, ...);

/// Of a share, with as many decimals as one looks at: 0.0123 is "1.23".
[[nodiscard]] std::string percent(double share);

/// As JSON has it; null where there is none, or none that is finite.
[[nodiscard]] std::string number(double v);
[[nodiscard]] std::string number(const std::optional<double>& v);

/// One text a column.
using TableLine = std::vector<std::string>;
/// Markdown, columns as wide as they need. The first line is the head; the first `left` columns and the last one are
/// flush left.
[[nodiscard]] std::string markdown_table(std::span<const TableLine> lines, std::size_t left);

}  // namespace lightwell::eval
