// lightwell-calibrate geometry and coverage: lens models from pictures of boards, and the views still missing.
#pragma once

#include <string>
#include <vector>

namespace lightwell::calibrate {

/// `arguments`: those after the subcommand. Exit status: 0 done, 1 an input is wrong, 2 wrong usage; of coverage also
/// 3: some views are missing.
[[nodiscard]] int geometry_command(const std::vector<std::string>& arguments);
[[nodiscard]] int coverage_command(const std::vector<std::string>& arguments);

}  // namespace lightwell::calibrate
