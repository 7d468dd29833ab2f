// A command of lightwell-calibrate as a test calls it: words in, an exit status and what was said out.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace lightwell::test {

struct Said {
  int status = -1;
  std::string out, err;
};

template <class Command>
Said run(Command command, std::vector<std::string> words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Said said;
  said.status = command(std::span<char* const>(pointers));
  said.out = testing::internal::GetCapturedStdout();
  said.err = testing::internal::GetCapturedStderr();
  return said;
}

}  // namespace lightwell::test
