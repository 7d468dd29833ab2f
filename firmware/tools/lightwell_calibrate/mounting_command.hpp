// lightwell-calibrate mounting: where in the room the probe hangs.
#pragma once

#include <span>

namespace lightwell::calibrate {

/// `arguments` are those after the word "mounting". The exit status: 0 done, 1 wrong input, 2 wrong usage.
int mounting_command(std::span<char* const> arguments);

}  // namespace lightwell::calibrate
