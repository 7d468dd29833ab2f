// The probe's end of MQTT, at a real broker.
#include "link/mqtt/mqtt_link.hpp"

#include <atomic>
#include <csignal>
#include <cstdint>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/mqtt.hpp>
#include <lightwell/status_codec.hpp>
#include <lightwell/time.hpp>

#include "support/broker.hpp"
#include "support/fake_commands.hpp"
#include "support/mqtt_client.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

const MqttTopics kTopics("venue/attic");

EncodedDescriptor bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end());
}

std::span<const std::byte> bytes(const std::string& text) { return std::as_bytes(std::span(text)); }

class MqttLinkTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<Link> started(const MqttConfig& config) {
    std::unique_ptr<Link> link = make_mqtt_link(config, "attic", commands_);
    const Status status = link->start();
    EXPECT_TRUE(status.ok()) << status.message();
    return link;
  }
  static ::testing::AssertionResult connects(const Link& link) {
    return becomes_true("the link is connected: " + link.error_message(), [&] { return link.counters().clients == 1; });
  }

  FakeCommands commands_;
};

TEST_F(MqttLinkTest, RetainsTheVeryBytesAndTheStatus) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  EXPECT_EQ(link->address(), broker.uri("venue/attic"));
  ASSERT_TRUE(connects(*link));
  EXPECT_EQ(link->error_message(), "");
  const std::string anything("\0\x01\xff bytes", 9);
  link->publish(bytes_of(anything));
  MqttClient early(broker.port(), {kTopics.descriptor});
  ASSERT_EQ(early.newest(kTopics.descriptor)->payload, anything);
  MqttClient late(broker.port(), {kTopics.descriptor, kTopics.status});
  EXPECT_TRUE(late.newest(kTopics.descriptor)->retained);
  const auto status = late.newest(kTopics.status);
  ASSERT_TRUE(status);
  const Result<StatusSnapshot> told = decode_status(bytes(status->payload));
  ASSERT_TRUE(told.ok()) << told.status().message();
  EXPECT_EQ(*told, FakeCommands().status());
  EXPECT_FALSE(decode_clock(bytes(status->payload)).ok()) << "a retained clock would be a lie";
}

TEST_F(MqttLinkTest, StoppedSaysThatItIsGone) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  MqttClient client(broker.port(), {kTopics.status});
  ASSERT_TRUE(becomes_true("the status is there", [&] { return client.count(kTopics.status) > 0; }));
  link->stop();
  EXPECT_TRUE(becomes_true("it is gone", [&] { return client.newest(kTopics.status)->payload == kMqttGone; }));
  MqttClient late(broker.port(), {kTopics.status});
  EXPECT_EQ(late.newest(kTopics.status)->payload, kMqttGone);
}

TEST_F(MqttLinkTest, TellsItsClockToWhoAsks) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  ASSERT_TRUE(connects(*link));
  const std::string reply = kTopics.replies + "me";
  MqttClient client(broker.port(), {reply});
  const std::int64_t before = monotonic_now_ns();
  client.publish({kTopics.clock, "", false, reply, "seven"});
  const auto answer = client.newest(reply);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->correlation, "seven");
  EXPECT_FALSE(answer->retained);
  const Result<ProbeTime> clock = decode_clock(bytes(answer->payload));
  ASSERT_TRUE(clock.ok());
  EXPECT_GE(clock->ns, before);
  EXPECT_LE(clock->ns, monotonic_now_ns());
}

TEST_F(MqttLinkTest, ARequestThatWouldMakeItWriteElsewhereIsRefusedAndCounted) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  ASSERT_TRUE(connects(*link));
  MqttClient client(broker.port(), {"#"});
  const std::string reply = kTopics.replies + "me";
  client.publish({kTopics.clock, "", false, kTopics.status, "x"});           // would replace the status
  client.publish({kTopics.clock, "", false, "other/topic", "x"});            // somebody else's
  client.publish({kTopics.clock, "", false, reply + "/deeper", "x"});        // not one level
  client.publish({kTopics.clock, "", false, reply, ""});                     // no correlation
  client.publish({kTopics.clock, "", false, reply, std::string(65, 'x')});   // too much of it
  client.publish({kTopics.clock, std::string(65, 'x'), false, reply, "x"});  // a payload that is no question
  client.publish({kTopics.clock, "", false, "", "x"});                       // nowhere to answer
  EXPECT_TRUE(becomes_true("all are counted", [&] { return link->counters().messages_refused == 7; }))
      << link->counters().messages_refused;
  client.publish({kTopics.clock, "", false, reply, "x"});
  EXPECT_TRUE(client.newest(reply)) << "it goes on answering who asks well";
  EXPECT_EQ(client.count("other/topic"), 0U);
  EXPECT_EQ(client.count(reply + "/deeper"), 0U);
  EXPECT_EQ(client.count(reply), 1U);
  for (const BrokerMessage& note : client.notes()) {
    if (note.topic != kTopics.status) continue;
    EXPECT_TRUE(decode_status(bytes(note.payload)).ok()) << "nobody else wrote it";
  }
}

TEST_F(MqttLinkTest, AFloodOfRequestsIsAnsweredWithinBounds) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  ASSERT_TRUE(connects(*link));
  const std::string reply = kTopics.replies + "me";
  MqttClient client(broker.port(), {reply});
  const std::int64_t begin = monotonic_now_ns();
  constexpr std::size_t kFlood = 5000;
  client.flood({kTopics.clock, "", false, reply, "x"}, kFlood);
  EXPECT_TRUE(becomes_true("every request is answered or counted",
                         [&] { return client.count(reply) + link->counters().messages_refused == kFlood; }))
      << client.count(reply) << " answered, " << link->counters().messages_refused << " refused";
  const double seconds = static_cast<double>(monotonic_now_ns() - begin) * 1e-9;
  EXPECT_GE(client.count(reply), 400U) << "who asks well is answered";
  // A full allowance at the start, and 500 a second from then on.
  EXPECT_LE(static_cast<double>(client.count(reply)), 501 + 500 * seconds);
}

TEST_F(MqttLinkTest, StartsWithoutABrokerAndFindsItWhenItComes) {
  Broker broker;
  broker.stop();
  const auto link = started({.uri = broker.uri("venue/attic")});
  EXPECT_TRUE(becomes_true("it says why nobody hears it", [&] {
    return link->error_message().find("refused") != std::string::npos;
  })) << link->error_message();
  EXPECT_EQ(link->counters().clients, 0U);
  for (int i = 0; i < 5; ++i) link->publish(bytes_of(std::to_string(i)));
  EXPECT_EQ(link->counters().coalesced, 4U) << "one place, the newest wins";
  broker.start();
  MqttClient client(broker.port(), {kTopics.descriptor, kTopics.status});
  EXPECT_EQ(client.newest(kTopics.descriptor)->payload, "4");
  EXPECT_TRUE(connects(*link));
  broker.stop();
  EXPECT_TRUE(becomes_true("it notices", [&] { return link->counters().clients == 0; }));
  broker.start();
  EXPECT_TRUE(connects(*link));
}

TEST_F(MqttLinkTest, ABrokerThatStallsDoesNotHoldThePublisherUp) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  ASSERT_TRUE(connects(*link));
  MqttClient client(broker.port(), {kTopics.descriptor});
  broker.process().signal(SIGSTOP);
  // More than all buffers in between hold: they are kept small, so that what comes out is new.
  const std::string large(60'000, 'x');
  std::int64_t longest_ns = 0;
  std::size_t published = 0;
  ASSERT_TRUE(becomes_true("descriptors are coalesced", [&] {
    const std::int64_t begin = monotonic_now_ns();
    link->publish(bytes_of(std::to_string(++published) + large));
    longest_ns = std::max(longest_ns, monotonic_now_ns() - begin);
    return link->counters().coalesced > 500;
  }));
  EXPECT_LT(longest_ns, 500'000'000) << "a place under a lock; the rest is a busy machine";
  // The kernel of the broker's side takes some megabytes before it stops us.
  EXPECT_LE(published - link->counters().coalesced, 300U);
  const std::string last = "the last";
  link->publish(bytes_of(last));
  broker.process().signal(SIGCONT);
  EXPECT_TRUE(becomes_true("the newest comes, without all that was between", [&] {
    return client.count(kTopics.descriptor) > 0 && client.newest(kTopics.descriptor)->payload == last;
  }));
}

TEST_F(MqttLinkTest, StopsWithinASecondWhateverTheBrokerDoes) {
  Broker broker;
  for (const bool stalled : {false, true}) {
    const auto link = started({.uri = broker.uri("venue/attic")});
    ASSERT_TRUE(connects(*link));
    if (stalled) broker.process().signal(SIGSTOP);
    const std::int64_t begin = monotonic_now_ns();
    link->stop();
    EXPECT_LT(monotonic_now_ns() - begin, 1'500'000'000);
    broker.process().signal(SIGCONT);
  }
}

TEST_F(MqttLinkTest, ComesInWithTlsAndAPassword) {
  const Authority authority("venue");
  Broker broker(
      {.tls = authority.sign("broker"), .client_ca = authority.certificate(), .users = {{"attic", "s3cret"}}});
  const KeyPair own = authority.sign("probe");
  const TempDir folder;
  MqttConfig config{.uri = broker.uri("venue/attic"),
                    .ca_file = authority.certificate(),
                    .certificate_file = own.certificate,
                    .key_file = own.key,
                    .login_file = folder.write("login", "attic\ns3cret\n"),
                    .client_id = {}};
  EXPECT_TRUE(connects(*started(config)));

  const auto denial_reason = [&](const MqttConfig& wrong, const std::string& said) {
    const auto link = started(wrong);
    EXPECT_TRUE(becomes_true("the refusal is told: " + said, [&] {
      return link->error_message().find(said) != std::string::npos;
    })) << link->error_message();
    EXPECT_EQ(link->counters().clients, 0U);
  };
  MqttConfig wrong = config;
  wrong.login_file = folder.write("wrong", "attic\nguess\n");
  denial_reason(wrong, "authori");
  wrong = config;
  const Authority other("elsewhere");
  wrong.ca_file = other.certificate();
  denial_reason(wrong, "certificate verify failed");
  wrong = config;
  wrong.certificate_file = wrong.key_file = {};
  denial_reason(wrong, "a certificate of ours");
}

TEST_F(MqttLinkTest, DoesNotTrustABrokerWhoseCertificateExpiredOrNamesAnother) {
  const Authority authority("venue");
  for (const KeyPair& bad :
       {authority.sign("old", "IP:127.0.0.1", -1), authority.sign("other", "DNS:elsewhere.example")}) {
    Broker broker({.tls = bad});
    const auto link = started({.uri = broker.uri("venue/attic"), .ca_file = authority.certificate()});
    EXPECT_TRUE(becomes_true("it says why", [&] {
      return link->error_message().find("certificate verify failed") != std::string::npos;
    })) << link->error_message();
    EXPECT_EQ(link->counters().clients, 0U);
  }
}

TEST_F(MqttLinkTest, AConfigurationThatCannotWorkRefusesToStart) {
  const auto denial_reason = [&](const MqttConfig& config) { return make_mqtt_link(config, "attic", commands_)->start(); };
  EXPECT_EQ(denial_reason({.uri = "mqtt://broker/venue/+"}).code(), StatusCode::invalid_argument);
  const Status missing = denial_reason({.uri = "mqtts://broker/venue/attic", .ca_file = "/no/such.pem"});
  EXPECT_EQ(missing.code(), StatusCode::not_found);
  EXPECT_THAT(missing.message(), HasSubstr("/no/such.pem"));
  const TempDir folder;
  const Status plain = denial_reason({.uri = "mqtt://broker/venue/attic", .login_file = folder.write("login", "ann\nx\n")});
  EXPECT_THAT(plain.message(), HasSubstr("LINK_SECURITY_PLAIN"));
  const Status empty =
      denial_reason({.uri = "mqtts://broker/venue/attic", .login_file = folder.write("login", "\nsecret\n")});
  EXPECT_THAT(empty.message(), HasSubstr("user name"));
}

}  // namespace
}  // namespace lightwell::test
