// The lights and objects of a scene file.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "ar_viewer/scene.hpp"

namespace lightwell::viewer {

// `status` gets the first error, with the path of the field.
[[nodiscard]] LightDescription read_light(const nlohmann::json& json, const std::string& where,
                                          const std::string& folder, Status& status);
[[nodiscard]] std::vector<Object> read_objects(const nlohmann::json& json, const std::string& folder, Status& status);
}  // namespace lightwell::viewer
