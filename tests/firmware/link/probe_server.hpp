// A link on the loopback, with commands that a test can look at.
#pragma once

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "firmware/link/client.hpp"
#include "link/grpc/grpc_link.hpp"
#include "support/fake_commands.hpp"

namespace lightwell::test {

class GrpcLinkTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(link_->start().ok()); }

  /// Clients that the server knows of.
  [[nodiscard]] ::testing::AssertionResult clients_become(std::uint32_t count) const {
    return becomes_true("the link has " + std::to_string(count) + " clients",
                      [&] { return link_->counters().clients == count; });
  }

  FakeCommands commands_;  // first: the link calls it
  std::unique_ptr<Link> link_ = make_grpc_link({.listen = "127.0.0.1:0"}, "attic", commands_);
};

}  // namespace lightwell::test
