// The daemon's log: lines on stderr, with the priority prefix that journald reads where stderr goes to it. A message is
// one line, whatever it quotes of clients and brokers: printable() escapes it.
#pragma once

#include <string>

namespace lightwell {

void log_info(const std::string& line);
void log_error(const std::string& line);

}  // namespace lightwell
