#include "exit_code.hpp"

#include <cstdio>
#include <string>

#include <lightwell/printable.hpp>

namespace lightwell::tool {
namespace {

ExitCode code_of(StatusCode code) {
  switch (code) {
    case StatusCode::ok:
      return kOk;
    case StatusCode::invalid_argument:
      return kUsage;
    case StatusCode::unavailable:
      return kUnreachable;
    default:
      return kFile;
  }
}

}  // namespace

int fail(ExitCode code, std::string_view message) {
  std::fprintf(stderr, "lightwell: %s\n", printable(message).c_str());
  return code;
}

int fail(const Status& status) { return fail(code_of(status.code()), status.message()); }

}  // namespace lightwell::tool
