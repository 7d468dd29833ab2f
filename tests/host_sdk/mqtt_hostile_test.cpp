// Other clients that publish on a probe's topics: their messages are rejected and counted, the probe's light is kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host_sdk/probe_at_broker.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

class MqttHostileTest : public ::testing::Test {
 protected:
  MqttHostileTest() {
    attic_.say_alive();
    Result<Probe> probe = Probe::connect(broker_.uri("venue/attic"), patient());
    EXPECT_TRUE(probe.ok()) << probe.status().message();
    probe_.emplace(std::move(*probe));
    first_ = attic_.descriptor(100, 50 * kMs);
    attic_.say(first_);
    EXPECT_TRUE(newest_becomes(*probe_, 100));
  }
  /// Checks that the newest descriptor is still the probe's, and that its next one is received.
  void survived() {
    EXPECT_EQ(probe_->latest().descriptor().sequence, 100U);
    attic_.say(attic_.descriptor(101, 0));
    EXPECT_TRUE(newest_becomes(*probe_, 101));
    EXPECT_EQ(probe_->stats().state, LinkState::connected);
    EXPECT_EQ(probe_->stats().received, 2U);
  }
  void publish(const std::string& bytes) { mallory_.publish(attic_.topics.descriptor, bytes); }

  Broker broker_;
  ProbeAtBroker attic_{broker_};
  MqttClient mallory_{broker_.port(), {"#"}};
  std::optional<Probe> probe_;
  std::string first_;
};

TEST_F(MqttHostileTest, GarbageAndTruncatedMessagesAreRejected) {
  publish("");
  publish(std::string(1, '\0'));
  publish("gone");
  publish(std::string(1000, '\xFF'));
  std::uint64_t bad = 4;
  const std::string fresh = attic_.descriptor(500, 0);
  for (std::size_t n = 1; n < fresh.size(); ++n) {
    if (decode_descriptor(as_bytes(fresh.substr(0, n))).ok())
      continue;  // cut between two fields: a whole, shorter message
    publish(fresh.substr(0, n));
    ++bad;
  }
  EXPECT_GT(bad, 50U);
  EXPECT_TRUE(becomes_true("all are counted", [&] { return probe_->stats().undecodable == bad; }))
      << probe_->stats().undecodable;
  survived();
}

TEST_F(MqttHostileTest, OversizedMessagesAreRejected) {
  publish(std::string(kMaxDescriptorBytes + 1, 'x'));
  publish(std::string(200'000, 'x'));
  EXPECT_TRUE(becomes_true("both are counted", [&] { return probe_->stats().oversized == 2; }));
  // Above the client's Maximum Packet Size: the broker does not forward it.
  publish(std::string(3'000'000, 'x'));
  EXPECT_TRUE(becomes_true("other subscribers receive it",
                           [&] { return mallory_.newest(attic_.topics.descriptor)->payload.size() == 3'000'000; }));
  survived();
  EXPECT_EQ(probe_->stats().oversized, 2U);
  EXPECT_EQ(probe_->stats().reconnects, 0U);
}

TEST_F(MqttHostileTest, AReplayNeverBecomesTheNewest) {
  publish(first_);                                                           // the same again
  publish(attic_.descriptor(7, 10'000 * kMs));                               // an old one
  publish(attic_.descriptor(9'999, 51 * kMs + monotonic_now_ns() / 1'000));  // old, with a sequence to come
  EXPECT_TRUE(becomes_true("all are counted", [&] { return probe_->stats().untimely == 3; }))
      << probe_->stats().untimely;
  EXPECT_THAT(probe_->stats().last_error, HasSubstr("not newer"));
  survived();
  EXPECT_EQ(probe_->stats().gaps, 0U);
}

TEST_F(MqttHostileTest, DescriptorFromTheFutureIsRejected) {
  publish(attic_.descriptor(200, -60'000 * kMs));
  publish(attic_.descriptor(201, -86'400'000 * kMs));
  Descriptor beyond = numbered(202, 0);
  beyond.time.mid_exposure.ns = std::numeric_limits<std::int64_t>::max();
  publish(encoded(beyond));
  EXPECT_TRUE(
      becomes_true("all are counted", [&] { return probe_->stats().untimely + probe_->stats().undecodable == 3; }));
  EXPECT_GE(probe_->stats().untimely, 2U);
  survived();
}

TEST_F(MqttHostileTest, ForgedStatusIsCorrectedByTheNextOne) {
  for (const std::string& bad :
       {std::string(), std::string("going"), std::string(5'000, 'x'), std::string("\x0a\xff", 2)})
    mallory_.publish(attic_.topics.status, bad);
  EXPECT_TRUE(becomes_true("all are counted", [&] { return probe_->stats().undecodable == 4; }))
      << probe_->stats().undecodable;
  EXPECT_EQ(probe_->stats().state, LinkState::connected);
  mallory_.publish(attic_.topics.status, "gone");
  EXPECT_TRUE(becomes_true("the forged status is accepted", [&] { return probe_->stats().state == LinkState::gone; }));
  attic_.say_alive();
  EXPECT_TRUE(
      becomes_true("the next status corrects it", [&] { return probe_->stats().state == LinkState::connected; }));
  survived();
}

TEST_F(MqttHostileTest, UnsolicitedClockResponseIsIgnored) {
  // A client with full read access knows the reply topic, but not the correlation data of the last request.
  const auto question = mallory_.newest(attic_.topics.clock);
  ASSERT_TRUE(question);
  const Duration before = probe_->info().clock_offset;
  // Wait until the initial round trips are complete, so that no request is pending.
  ASSERT_TRUE(becomes_true("the initial clock requests were received", [&] { return attic_.clock_requests == 4; }));
  const std::string lie = encode_clock({attic_.now() - 3'000'000 * kMs});
  const std::uint64_t counted = probe_->stats().undecodable;
  mallory_.publish({question->response_topic, lie, false, {}, question->correlation});
  mallory_.publish({question->response_topic, lie, false, {}, std::string(16, 'x')});
  mallory_.publish({question->response_topic, lie, false, {}, {}});
  mallory_.publish({question->response_topic, std::string(100'000, 'x'), false, {}, question->correlation});
  EXPECT_TRUE(becomes_true("all are counted", [&] { return probe_->stats().undecodable == counted + 4; }));
  attic_.say_alive();
  EXPECT_LT(std::abs((probe_->info().clock_offset - before).ns), 1'000 * kMs);
  survived();
}

}  // namespace
}  // namespace lightwell::test
