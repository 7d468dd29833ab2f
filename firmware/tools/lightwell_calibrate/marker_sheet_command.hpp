// lightwell-calibrate marker-sheet: a body with tags to print, cut and fold, and its body file.
#pragma once

#include <span>

namespace lightwell::calibrate {

/// Words after "marker-sheet". Returns the exit status.
[[nodiscard]] int marker_sheet_command(std::span<char* const> arguments);

}  // namespace lightwell::calibrate
