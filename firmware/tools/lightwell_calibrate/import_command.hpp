// lightwell-calibrate import: converts a calibration of Kalibr, OpenCV or ROS to Lightwell's format.
#pragma once

#include <string>
#include <vector>

namespace lightwell::calibrate {

/// `arguments`: those after "import". Writes the file of --output, notes to stderr, and with --json a description of
/// the result to stdout. Returns the exit status: 0 done, 1 an input is wrong, 2 wrong usage.
[[nodiscard]] int import_command(const std::vector<std::string>& arguments);

}  // namespace lightwell::calibrate
