// lightwell-calibrate geometry and coverage: lenses from pictures of boards, and what pictures still lack.
#pragma once

#include <span>

namespace lightwell::calibrate {

/// `arguments` are the words after the subcommand. Exit status: 0 done, 1 an input is wrong, 2 wrong usage.
[[nodiscard]] int geometry_command(std::span<char* const> arguments);
[[nodiscard]] int coverage_command(std::span<char* const> arguments);

}  // namespace lightwell::calibrate
