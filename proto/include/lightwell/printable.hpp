// Text for a terminal or a log.
#pragma once

#include <string>
#include <string_view>

namespace lightwell {

/// Control characters (C0, C1, DEL, line and paragraph separators), marks that turn the direction of text (which make a
/// name look like another one), and bytes that are no UTF-8, as \xNN. Whoever prints or logs what came from a network,
/// a file or another user prints this: a line break would forge a line, an escape sequence would command the terminal.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace lightwell
