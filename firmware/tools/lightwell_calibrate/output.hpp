// Where answers go: a file that is there whole or not at all, or standard output.
#pragma once

#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell::calibrate {

/// As write_atomically() for everybody whom the umask lets; "-" is standard output.
[[nodiscard]] Status write_output(const std::string& path, std::string_view bytes);

}  // namespace lightwell::calibrate
