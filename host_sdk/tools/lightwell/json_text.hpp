// JSON as text.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace lightwell::tool {

/// The document in one line of ASCII, which is safe to print: all other characters and control characters are escaped.
/// A byte sequence that is not UTF-8 becomes U+FFFD. A number has the shortest text that gives the same double when
/// parsed; NaN and infinity become null.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& document);

}  // namespace lightwell::tool
