// Which panoramas are measured.
#pragma once

#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::eval {

/// "eight", "all", or names (city, pmndrs_lobby) and files with commas between: their files. not_found and
/// invalid_argument say what to do.
[[nodiscard]] Result<std::vector<std::string>> scene_files(const std::string& choice);

}  // namespace lightwell::eval
