// "scheme:path?key=value&key=value": how a camera and its settings are named.
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

/// invalid_argument where there is no scheme or a parameter has no '='.
[[nodiscard]] Result<CameraUri> parse_camera_uri(std::string_view text);

/// The known name with the smallest edit distance, or nothing where none is near.
[[nodiscard]] std::string nearest_name(std::string_view name, const std::vector<std::string_view>& known);

/// invalid_argument that names the first parameter which is not in `known`, with the nearest one that is.
[[nodiscard]] Status check_parameters(const CameraUri& uri, const std::vector<std::string_view>& known);

}  // namespace lightwell
