// Escaping of untrusted text for a terminal or a log.
#pragma once

#include <string>
#include <string_view>

namespace lightwell {

/// Escapes as \xNN: control characters (C0, C1, DEL, line and paragraph separators), bidirectional control characters
/// (which can disguise a name as another), and bytes that are not UTF-8. Use it for all text from a network, a file or
/// another user before printing or logging: line breaks could forge log lines, escape sequences control the terminal.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace lightwell
