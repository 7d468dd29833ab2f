// The daemon's log: one line per message on stderr, with journald's priority prefix if stderr is the journal. Control
// characters, which texts from clients and brokers may contain, are escaped by printable().
#pragma once

#include <string>

namespace lightwell {

void log_info(const std::string& line);
void log_error(const std::string& line);

}  // namespace lightwell
