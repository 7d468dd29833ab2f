#include "imaging/csv.hpp"

#include <algorithm>
#include <span>

#include <lightwell/text.hpp>

#include "imaging/uri.hpp"

namespace lightwell {
namespace {

/// The columns that the first line names.
Result<std::vector<std::string_view>> named_columns(const CsvRow& at, const std::vector<std::string_view>& cells,
                                                    const std::vector<std::string_view>& known, std::size_t required) {
  std::vector<std::string_view> out;
  for (const std::string_view cell : cells) {
    const auto column = std::ranges::find(known, cell);
    if (column == known.end()) {
      const std::string near = nearest_name(cell, known);
      return at.bad("unknown column '" + std::string(cell) + "'" +
                    (near.empty() ? "" : "; did you mean '" + near + "'?"));
    }
    if (std::ranges::find(out, cell) != out.end()) return at.bad("column " + std::string(cell) + " is listed twice");
    out.push_back(*column);
  }
  for (const std::string_view column : std::span(known).subspan(required))
    if (std::ranges::find(out, column) == out.end())
      return at.bad("column " + std::string(column) + " is missing in the first line");
  return out;
}

}  // namespace

Status CsvRow::read(std::string_view column, double& target) const {
  const auto cell = cells.find(column);
  if (cell == cells.end()) return {};
  const std::optional<double> number = parse_number<double>(cell->second);
  if (!number) return bad(std::string(column) + ": '" + cell->second + "' is not a number");
  target = *number;
  return {};
}

Result<std::vector<CsvRow>> parse_csv(std::string_view text, const std::string& name,
                                      const std::vector<std::string_view>& columns, std::size_t required,
                                      bool comments) {
  std::vector<CsvRow> out;
  std::vector<std::string_view> named;
  int line = 0;
  for (const std::string_view written : separated(text, '\n')) {
    CsvRow row{name + ":" + std::to_string(++line) + ": ", {}};
    const std::vector<std::string_view> cells = comma_separated(written);
    if (trimmed(written).empty() || (comments && cells[0].starts_with('#'))) continue;
    if (named.empty()) {
      if (Status s = named_columns(row, cells, columns, required).assign_to(named); !s.ok()) return s;
      continue;
    }
    if (cells.size() != named.size())
      return row.bad(formatted("%zu cells, where the first line names %zu", cells.size(), named.size()));
    for (std::size_t i = 0; i < cells.size(); ++i) row.cells.emplace(named[i], cells[i]);
    out.push_back(std::move(row));
  }
  return out;
}

}  // namespace lightwell
