#include "tools/lightwell_eval/formatting.hpp"

#include <algorithm>

#include <lightwell/text.hpp>

namespace lightwell::eval {

std::string percent(double share) { return formatted(share < 0.1 ? "%.2f" : share < 1 ? "%.1f" : "%.0f", 100 * share); }

std::string markdown_table(std::span<const TableLine> lines, std::size_t left) {
  std::vector<std::size_t> widths(lines.front().size());
  for (const TableLine& line : lines)
    for (std::size_t k = 0; k < line.size(); ++k) widths[k] = std::max(widths[k], line[k].size());
  const auto at_left = [&](std::size_t k) { return k < left || k + 1 == widths.size(); };
  std::string out;
  for (std::size_t n = 0; n < lines.size(); ++n) {
    for (std::size_t k = 0; k < widths.size(); ++k) {
      const std::string space(widths[k] - lines[n][k].size(), ' ');
      out += "| ";
      out += at_left(k) ? lines[n][k] + space : space + lines[n][k];
      out += " ";
    }
    out += "|\n";
    if (n > 0) continue;
    for (std::size_t k = 0; k < widths.size(); ++k) {
      out += "| ";
      out.append(widths[k] - 1, '-');
      out += at_left(k) ? "- " : ": ";
    }
    out += "|\n";
  }
  return out;
}

}  // namespace lightwell::eval
