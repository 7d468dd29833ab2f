// The little JSON that the control socket understands: objects of one level, whose values are texts, numbers or truths.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <variant>

#include <lightwell/result.hpp>

namespace lightwell::usb_camera {

using JsonValue = std::variant<std::string, double, bool>;
using JsonObject = std::map<std::string, JsonValue, std::less<>>;

/// RFC 8259, without arrays, objects in objects and null, which no command has. Of \u escapes those below 128.
/// invalid_argument says at which character it stopped.
[[nodiscard]] Result<JsonObject> parse_json_object(std::string_view text);

}  // namespace lightwell::usb_camera
