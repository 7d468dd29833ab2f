// lightwell-calibrate marker-sheet: a body with tags to print, cut and fold, and its body file.
#pragma once

#include <string>
#include <vector>

namespace lightwell::calibrate {

/// `arguments`: those after "marker-sheet". Returns the exit status: 0 done, 1 wrong input, 2 wrong usage.
[[nodiscard]] int marker_sheet_command(const std::vector<std::string>& arguments);

}  // namespace lightwell::calibrate
