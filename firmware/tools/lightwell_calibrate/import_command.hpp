// lightwell-calibrate import: another program's calibration becomes a calibration of ours.
#pragma once

#include <span>

namespace lightwell::calibrate {

/// `arguments` are the words after "import". Writes the file that --output names, notes to stderr, and with --json what
/// was imported to stdout. Returns the exit status: 0 done, 1 an input is wrong, 2 wrong usage.
[[nodiscard]] int import_command(std::span<char* const> arguments);

}  // namespace lightwell::calibrate
