// Runs a subcommand of lightwell-calibrate in the process of the test and captures its exit status and output.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace lightwell::test {

struct CommandResult {
  int status = -1;
  std::string out, err;
};

template <class Command>
CommandResult run(Command command, std::vector<std::string> words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  CommandResult result;
  result.status = command(std::span<char* const>(pointers));
  result.out = testing::internal::GetCapturedStdout();
  result.err = testing::internal::GetCapturedStderr();
  return result;
}

}  // namespace lightwell::test
