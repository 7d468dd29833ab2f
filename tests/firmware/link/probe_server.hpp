// Fixture: a plain-text gRPC link on the loopback with fake commands.
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

  /// Waits until the link counts `count` clients.
  [[nodiscard]] ::testing::AssertionResult clients_become(std::uint32_t count) const {
    return becomes_true("the link has " + std::to_string(count) + " clients",
                        [&] { return link_->counters().clients == count; });
  }

  FakeCommands commands_;  // Before the link, which uses it.
  std::unique_ptr<Link> link_ = make_grpc_link({.listen_address = "127.0.0.1:0"}, "attic", commands_);
};

}  // namespace lightwell::test
