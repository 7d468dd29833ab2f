// Start and stop of the gRPC link.
#include <future>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/link/probe_server.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

class GrpcLifeTest : public GrpcLinkTest {
 protected:
  /// Stops the link; a stop() that hangs fails the test instead of blocking it.
  void expect_stop() {
    std::future<void> stopped = std::async(std::launch::async, [this] { link_->stop(); });
    ASSERT_EQ(stopped.wait_for(kTestTimeout), std::future_status::ready) << "waited for stop()";
  }
};

TEST_F(GrpcLifeTest, PortZeroChoosesAFreePort) {
  EXPECT_THAT(link_->address(), MatchesRegex("grpc://127\\.0\\.0\\.1:[0-9]+"));
  EXPECT_THAT(link_->address(), Not(MatchesRegex(".*:0")));
}

TEST_F(GrpcLifeTest, ASecondLinkOnAPortFailsWithAddressAndRemedy) {
  const std::string taken = host_port(*link_);
  const std::unique_ptr<Link> second = make_grpc_link({.listen_address = taken}, "attic", commands_);
  const Status s = second->start();
  EXPECT_EQ(s.code(), StatusCode::resource_exhausted);
  EXPECT_THAT(s.message(), HasSubstr(taken));
  EXPECT_THAT(s.message(), HasSubstr("in use"));
  EXPECT_THAT(s.message(), HasSubstr("--listen"));
  second->stop();
  RawStream still(connect(*link_));
  EXPECT_TRUE(clients_become(1)) << "the first link still serves";
}

TEST_F(GrpcLifeTest, AMalformedAddressIsRefused) {
  for (const std::string listen :
       {"", "127.0.0.1", "127.0.0.1:port", "127.0.0.1:99999", "[::1:80", "256.256.256.256:80", "192.0.2.1:7420"}) {
    const std::unique_ptr<Link> link = make_grpc_link({.listen_address = listen}, "attic", commands_);
    const Status s = link->start();
    EXPECT_FALSE(s.ok()) << listen << " became " << link->address();
    EXPECT_THAT(s.message(), HasSubstr("'" + listen + "'"));
  }
}

TEST_F(GrpcLifeTest, StopEndsTheStreamsWithUnavailable) {
  RawStream one(connect(*link_)), other(connect(*link_));
  ASSERT_TRUE(clients_become(2));
  link_->publish(message(1));
  expect_stop();
  for (RawStream* stream : {&one, &other}) {
    const grpc::Status end = stream->end();
    EXPECT_EQ(end.error_code(), grpc::StatusCode::UNAVAILABLE);
  }
}

TEST_F(GrpcLifeTest, StopDoesNotWaitForAClientThatDoesNotRead) {
  RawStream slow(connect(*link_));
  ASSERT_TRUE(clients_become(1));
  for (int i = 0; i < 2000 && link_->counters().coalesced == 0; ++i) {
    link_->publish(message(i, 60'000));
    std::this_thread::yield();
  }
  ASSERT_GT(link_->counters().coalesced, 0U);
  expect_stop();
}

TEST_F(GrpcLifeTest, StopDoesNotWaitForAClientThatKeepsItsConnection) {
  const std::shared_ptr<grpc::Channel> idle = connect(*link_);
  EXPECT_TRUE(call(idle, "/lightwell.v1.ProbeService/Info", "").status.ok());
  expect_stop();
}

TEST_F(GrpcLifeTest, AfterStopThePortIsFree) {
  const std::string port = host_port(*link_);
  expect_stop();
  const std::unique_ptr<Link> next = make_grpc_link({.listen_address = port}, "attic", commands_);
  EXPECT_TRUE(becomes_true("the port is free again", [&] { return next->start().ok(); }));
  EXPECT_EQ(host_port(*next), port);
}

TEST_F(GrpcLifeTest, StopTwiceIsHarmless) {
  expect_stop();
  expect_stop();
}

}  // namespace
}  // namespace lightwell::test
