// Output to a file, written atomically, or to standard output.
#pragma once

#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell::calibrate {

/// write_atomically() with the permissions of the umask; "-" is standard output.
[[nodiscard]] Status write_output(const std::string& path, std::string_view bytes);

}  // namespace lightwell::calibrate
