// Parser for the JSON of the control socket: flat objects whose values are strings, numbers or booleans.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <variant>

#include <lightwell/result.hpp>

namespace lightwell::usb_camera {

using JsonValue = std::variant<std::string, double, bool>;
using JsonObject = std::map<std::string, JsonValue, std::less<>>;

/// RFC 8259 without arrays, nested objects and null; \u escapes only below 128. invalid_argument names the character at
/// which parsing failed.
[[nodiscard]] Result<JsonObject> parse_json_object(std::string_view text);

}  // namespace lightwell::usb_camera
