// The daemon's log escapes control characters in texts from clients, brokers and networks.
#include <string>

#include <gtest/gtest.h>

#include "app/daemon.hpp"

namespace lightwell {
namespace {

std::string logged(const std::string& message) {
  ::testing::internal::CaptureStderr();
  log_info(message);
  return ::testing::internal::GetCapturedStderr();
}

TEST(Log, AMessageIsOneLineWhateverItContains) {
  const std::string begin = logged("").substr(0, logged("").size() - 1);
  EXPECT_EQ(logged("paired with ann\n<3>lightwelld: error: the camera went away"),
            begin + "paired with ann\\x0a<3>lightwelld: error: the camera went away\n");
  EXPECT_EQ(logged("\x1b[2J\r\x07"), begin + "\\x1b[2J\\x0d\\x07\n");
  EXPECT_EQ(logged("\xFF\u202E"), begin + "\\xff\\xe2\\x80\\xae\n");
  EXPECT_EQ(logged("B\u00FCro"), begin + "B\u00FCro\n");
}

}  // namespace
}  // namespace lightwell
