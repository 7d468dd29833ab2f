// Camera URIs, "scheme:path?key=value&key=value".
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell {

struct CameraUri {
  std::string scheme;
  std::string path;
  std::vector<std::pair<std::string, std::string>> parameters;  ///< In the order written.
};

/// invalid_argument if the scheme is missing, a parameter has no '=', or a parameter occurs twice.
[[nodiscard]] Result<CameraUri> parse_camera_uri(std::string_view text);

/// The name in `known` with the smallest edit distance (Levenshtein), or empty if that distance is too large.
[[nodiscard]] std::string nearest_name(std::string_view name, const std::vector<std::string_view>& known);

/// A parameter that had another name, which is still accepted.
struct RenamedParameter {
  std::string_view former, current;
};

/// Replaces former names of parameters by the current ones; appends to `warnings` for each. invalid_argument if a
/// parameter is given by both names.
[[nodiscard]] Status rename_parameters(CameraUri& uri, const std::vector<RenamedParameter>& renamed,
                                       std::vector<std::string>& warnings);

/// invalid_argument for the first parameter that is not in `known`; the message suggests the nearest known name.
[[nodiscard]] Status check_parameters(const CameraUri& uri, const std::vector<std::string_view>& known);

}  // namespace lightwell
