// Exit codes and error messages of the tool.
#pragma once

#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell::tool {

enum ExitCode : int {
  kOk = 0,
  kNothingReceived = 1,
  kUsage = 2,
  kUnreachable = 3,
  kFile = 4,
};

/// Writes "lightwell: ..." to stderr and returns `code`.
int fail(ExitCode code, std::string_view message);
/// The same, with the exit code for the status.
int fail(const Status& status);

}  // namespace lightwell::tool
