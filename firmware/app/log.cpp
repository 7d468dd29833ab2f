#include "app/log.hpp"

#include <cstdlib>
#include <iostream>

#include <lightwell/text.hpp>

namespace lightwell {
namespace {

void write(const char* journal_prefix, const char* plain_prefix, const std::string& line) {
  // systemd sets JOURNAL_STREAM for a service whose stderr is the journal.
  static const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  std::cerr << (journal ? journal_prefix : plain_prefix) << printable(line) << std::endl;
}

}  // namespace

void log_info(const std::string& line) { write("<6>", "lightwelld: ", line); }
void log_error(const std::string& line) { write("<3>", "lightwelld: error: ", line); }

}  // namespace lightwell
