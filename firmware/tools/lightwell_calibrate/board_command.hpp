// lightwell-calibrate board: a board of tags to print.
#pragma once

#include <span>

namespace lightwell::calibrate {

/// `arguments`: those after "board". Returns the exit status: 0 done, 1 wrong input, 2 wrong usage.
int board_command(std::span<char* const> arguments);

}  // namespace lightwell::calibrate
