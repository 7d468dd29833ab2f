// Where answers go: a file that is there whole or not at all, or standard output.
#pragma once

#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell::calibrate {

/// Writes beside `path`, flushes to the disk and renames: a reader, or a power cut, sees the old file or the new one.
/// data_loss naming the path.
[[nodiscard]] Status write_atomically(const std::string& path, std::string_view bytes);

/// The same; "-" is standard output.
[[nodiscard]] Status write_output(const std::string& path, std::string_view bytes);

}  // namespace lightwell::calibrate
