// Text as JSON has it.
#pragma once

#include <string>
#include <string_view>

namespace lightwell {

/// With quotes, escaped (RFC 8259, 7); what printable() escapes, too, so that JSON does no harm at a terminal. A byte
/// that is no UTF-8 becomes U+FFFD.
[[nodiscard]] std::string json_string(std::string_view text);

}  // namespace lightwell
