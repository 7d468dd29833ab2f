// Selection of the panoramas.
#pragma once

#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::eval {

/// Paths of the panoramas for "eight", "all", or a comma-separated list of names (city, pmndrs_lobby) and files.
/// not_found and invalid_argument; the message has the remedy.
[[nodiscard]] Result<std::vector<std::string>> scene_files(const std::string& choice);

}  // namespace lightwell::eval
