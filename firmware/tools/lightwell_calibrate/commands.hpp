// The subcommands of lightwell-calibrate.
#pragma once

#include <string>
#include <vector>

namespace lightwell::calibrate {

/// `arguments`: those after the subcommand. Exit status: 0 done, 1 a bad input, 2 wrong usage, 3 coverage lacks views.
[[nodiscard]] int board_command(const std::vector<std::string>& arguments);
[[nodiscard]] int marker_sheet_command(const std::vector<std::string>& arguments);
[[nodiscard]] int coverage_command(const std::vector<std::string>& arguments);
[[nodiscard]] int geometry_command(const std::vector<std::string>& arguments);
[[nodiscard]] int photometry_command(const std::vector<std::string>& arguments);
[[nodiscard]] int mounting_command(const std::vector<std::string>& arguments);
[[nodiscard]] int import_command(const std::vector<std::string>& arguments);

}  // namespace lightwell::calibrate
