// lightwell-calibrate photometry: response, black level, noise, vignetting, white balance and absolute scale of one
// lens.
#pragma once

#include <string>
#include <vector>

namespace lightwell::calibrate {

/// `arguments`: those after "photometry". Prints to standard output and error. Returns the exit status: 0 done, 1 an
/// input is wrong, 2 wrong usage.
[[nodiscard]] int photometry_command(const std::vector<std::string>& arguments);

}  // namespace lightwell::calibrate
