// JSON strings.
#pragma once

#include <string>
#include <string_view>

namespace lightwell {

/// Quoted and escaped (RFC 8259, section 7). Also escapes what printable() does, so that the JSON is safe to print. A
/// byte that is not UTF-8 becomes U+FFFD.
[[nodiscard]] std::string json_string(std::string_view text);

}  // namespace lightwell
