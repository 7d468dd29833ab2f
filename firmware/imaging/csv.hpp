// Tables in CSV files. The first line names the columns, in any order. Quotes are not supported: cells cannot contain
// commas.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell {

struct CsvRow {
  std::string place;                              ///< "FILE:LINE: "
  std::map<std::string_view, std::string> cells;  ///< By column.

  [[nodiscard]] Status bad(const std::string& what) const { return invalid_argument(place + what); }
  /// Assigns the number in a column; `target` stays as it is if the table lacks the column.
  [[nodiscard]] Status read(std::string_view column, double& target) const;
};

/// The rows below the first line, without empty lines and, if `comments`, without lines that begin with #.
/// `columns` are string literals; those from `required` on must be there. invalid_argument has `name` and the line.
[[nodiscard]] Result<std::vector<CsvRow>> parse_csv(std::string_view text, const std::string& name,
                                                    const std::vector<std::string_view>& columns, std::size_t required,
                                                    bool comments = false);

}  // namespace lightwell
