#include "tools/lightwell_calibrate/output.hpp"

#include <iostream>

#include <lightwell/files.hpp>

namespace lightwell::calibrate {

Status write_output(const std::string& path, std::string_view bytes) {
  if (path != "-") return write_atomically(path, bytes, FileMode::umask);
  std::cout << bytes << std::flush;
  return std::cout ? Status() : Status(StatusCode::data_loss, "standard output cannot be written");
}

}  // namespace lightwell::calibrate
