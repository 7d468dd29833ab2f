// lightwell-calibrate board: a board of tags to print.
#pragma once

#include <string>
#include <vector>

namespace lightwell::calibrate {

/// `arguments`: those after "board". Returns the exit status: 0 done, 1 wrong input, 2 wrong usage.
int board_command(const std::vector<std::string>& arguments);

}  // namespace lightwell::calibrate
