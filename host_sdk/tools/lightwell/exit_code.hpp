// How the tool ends: codes for scripts, one line for people.
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
/// The same, with the code that the status stands for.
int fail(const Status& status);

}  // namespace lightwell::tool
