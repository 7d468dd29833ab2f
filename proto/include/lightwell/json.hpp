// Text as JSON has it.
#pragma once

#include <string>
#include <string_view>

namespace lightwell {

/// With quotes, escaped (RFC 8259, 7).
[[nodiscard]] inline std::string json_string(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') out += '\\';
    if (code < 0x20)
      out += {'\\', 'u', '0', '0', kDigits[code >> 4], kDigits[code & 15]};
    else
      out += c;
  }
  return out + '"';
}

}  // namespace lightwell
