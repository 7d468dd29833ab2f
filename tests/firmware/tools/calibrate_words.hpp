// Runs a subcommand of lightwell-calibrate in the process of the test and captures its exit status and output.
#pragma once

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace lightwell::test {

struct CommandResult {
  int status = -1;
  std::string out, err;
};

template <class Command>
CommandResult run(Command command, const std::vector<std::string>& words) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  CommandResult result;
  result.status = command(words);
  result.out = testing::internal::GetCapturedStdout();
  result.err = testing::internal::GetCapturedStderr();
  return result;
}

}  // namespace lightwell::test
