// lightwell-calibrate photometry: response, black level, noise, vignetting, white balance and absolute scale of one
// lens.
#pragma once

#include <span>

namespace lightwell::calibrate {

/// `arguments`: what follows the subcommand's name. Prints to standard output and error. 0 done, 1 an input is wrong,
/// 2 wrong usage.
[[nodiscard]] int photometry_command(std::span<char* const> arguments);

}  // namespace lightwell::calibrate
