// The MQTT link with a real broker.
#include "link/mqtt/mqtt_link.hpp"

#include <atomic>
#include <csignal>
#include <cstdint>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/mqtt.hpp>
#include <lightwell/status.hpp>
#include <lightwell/time.hpp>

#include "support/broker.hpp"
#include "support/fake_commands.hpp"
#include "support/mqtt_client.hpp"
#include "support/plane_messages.hpp"

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

TEST_F(MqttLinkTest, PublishesDescriptorAndStatusRetained) {
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
  const Result<StatusSnapshot> decoded = decode_status(bytes(status->payload));
  ASSERT_TRUE(decoded.ok()) << decoded.status().message();
  EXPECT_EQ(*decoded, FakeCommands().status());
  EXPECT_FALSE(decode_clock(bytes(status->payload)).ok()) << "a retained clock would be outdated";
}

TEST_F(MqttLinkTest, StopPublishesGone) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  MqttClient client(broker.port(), {kTopics.status});
  ASSERT_TRUE(becomes_true("the status was published", [&] { return client.count(kTopics.status) > 0; }));
  link->stop();
  EXPECT_TRUE(
      becomes_true("the status is 'gone'", [&] { return client.newest(kTopics.status)->payload == kMqttGone; }));
  MqttClient late(broker.port(), {kTopics.status});
  EXPECT_EQ(late.newest(kTopics.status)->payload, kMqttGone);
}

TEST_F(MqttLinkTest, AnswersClockRequests) {
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

TEST_F(MqttLinkTest, RefusesRequestsWithForeignResponseTopics) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  ASSERT_TRUE(connects(*link));
  MqttClient client(broker.port(), {"#"});
  const std::string reply = kTopics.replies + "me";
  client.publish({kTopics.clock, "", false, kTopics.status, "x"});           // would overwrite the status
  client.publish({kTopics.clock, "", false, "other/topic", "x"});            // foreign topic
  client.publish({kTopics.clock, "", false, reply + "/deeper", "x"});        // two levels
  client.publish({kTopics.clock, "", false, reply, ""});                     // no correlation
  client.publish({kTopics.clock, "", false, reply, std::string(65, 'x')});   // correlation too long
  client.publish({kTopics.clock, std::string(65, 'x'), false, reply, "x"});  // payload too long
  client.publish({kTopics.clock, "", false, "", "x"});                       // no response topic
  EXPECT_TRUE(becomes_true("all are counted", [&] { return link->counters().messages_refused == 7; }))
      << link->counters().messages_refused;
  client.publish({kTopics.clock, "", false, reply, "x"});
  EXPECT_TRUE(client.newest(reply)) << "valid requests are still answered";
  EXPECT_EQ(client.count("other/topic"), 0U);
  EXPECT_EQ(client.count(reply + "/deeper"), 0U);
  EXPECT_EQ(client.count(reply), 1U);
  for (const BrokerMessage& message : client.messages()) {
    if (message.topic != kTopics.status) continue;
    EXPECT_TRUE(decode_status(bytes(message.payload)).ok()) << "only the link publishes the status";
  }
}

TEST_F(MqttLinkTest, LimitsTheRateOfClockAnswers) {
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
  EXPECT_GE(client.count(reply), 400U) << "requests within the limit are answered";
  // A full bucket at the start, and 500 a second from then on.
  EXPECT_LE(static_cast<double>(client.count(reply)), 501 + 500 * seconds);
}

TEST_F(MqttLinkTest, StartsWithoutABrokerAndConnectsLater) {
  Broker broker;
  broker.stop();
  const auto link = started({.uri = broker.uri("venue/attic")});
  EXPECT_TRUE(becomes_true("the error message has the reason", [&] {
    return link->error_message().find("refused") != std::string::npos;
  })) << link->error_message();
  EXPECT_EQ(link->counters().clients, 0U);
  for (int i = 0; i < 5; ++i) link->publish(bytes_of(std::to_string(i)));
  EXPECT_EQ(link->counters().coalesced, 4U) << "one slot, the newest wins";
  broker.start();
  MqttClient client(broker.port(), {kTopics.descriptor, kTopics.status});
  EXPECT_EQ(client.newest(kTopics.descriptor)->payload, "4");
  EXPECT_TRUE(connects(*link));
  broker.stop();
  EXPECT_TRUE(becomes_true("the loss is detected", [&] { return link->counters().clients == 0; }));
  broker.start();
  EXPECT_TRUE(connects(*link));
}

TEST_F(MqttLinkTest, AStalledBrokerDoesNotBlockThePublisher) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  ASSERT_TRUE(connects(*link));
  MqttClient client(broker.port(), {kTopics.descriptor});
  broker.process().signal(SIGSTOP);
  // More than all buffers between the link and the client hold. They are small, so that clients receive recent data.
  const std::string large(60'000, 'x');
  std::int64_t longest_ns = 0;
  std::size_t published = 0;
  ASSERT_TRUE(becomes_true("descriptors are coalesced", [&] {
    const std::int64_t begin = monotonic_now_ns();
    link->publish(bytes_of(std::to_string(++published) + large));
    longest_ns = std::max(longest_ns, monotonic_now_ns() - begin);
    return link->counters().coalesced > 500;
  }));
  EXPECT_LT(longest_ns, 500'000'000)
      << "publish() only stores a pointer under a lock; the limit allows for load on the machine";
  // The receive buffer on the broker's side takes some megabytes.
  EXPECT_LE(published - link->counters().coalesced, 300U);
  const std::string last = "the last";
  link->publish(bytes_of(last));
  broker.process().signal(SIGCONT);
  EXPECT_TRUE(becomes_true("the newest descriptor arrives", [&] {
    return client.count(kTopics.descriptor) > 0 && client.newest(kTopics.descriptor)->payload == last;
  }));
}

/// Names of the messages of planes that a client received, in order.
std::vector<std::string> planes_of(const MqttClient& client) {
  std::vector<std::string> names;
  for (const BrokerMessage& message : client.messages())
    if (message.topic == kTopics.plane) names.push_back(plane_name(bytes(message.payload)));
  return names;
}

TEST_F(MqttLinkTest, PublishesPlanesAndRetainsNone) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  MqttClient client(broker.port(), {kTopics.plane});
  ASSERT_TRUE(connects(*link));
  const auto received = [&](std::size_t count) {
    return becomes_true("the messages are there", [&] { return client.count(kTopics.plane) == count; });
  };
  link->publish_plane(plane_update(1, 1, 2));
  ASSERT_TRUE(received(2));
  link->publish_plane(plane_update(2, 2, 3));
  ASSERT_TRUE(received(4));
  EXPECT_THAT(planes_of(client), ::testing::ElementsAre("whole1.0", "whole1.1", "change2.0", "change2.1"));
  // One after the other, without a pause: a status is published once a second.
  link->publish_plane(plane_update(3, 60, 1));
  ASSERT_TRUE(received(64));
  // The broker keeps no photograph. A retained message would come before the descriptor.
  MqttClient late(broker.port(), {kTopics.plane, kTopics.descriptor});
  link->publish(bytes_of("later"));
  ASSERT_TRUE(late.newest(kTopics.descriptor));
  EXPECT_EQ(late.count(kTopics.plane), 0U);
}

/// Subscribers may have missed what was published before.
TEST_F(MqttLinkTest, ABrokerThatWasAwayGetsTheNewestPlaneWhole) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  ASSERT_TRUE(connects(*link));
  link->publish_plane(plane_update(0, 1, 1));
  MqttClient before(broker.port(), {kTopics.plane});
  link->publish_plane(plane_update(1, 1, 1));
  ASSERT_TRUE(before.newest(kTopics.plane)) << "later ones are sent as changes";
  std::vector<std::string> names;
  // The link pauses before it connects, so that the client is subscribed first; not always on a busy machine.
  int number = 1;
  while (names.empty() && number < 20) {
    broker.stop();
    EXPECT_TRUE(becomes_true("the loss is detected", [&] { return link->counters().clients == 0; }));
    link->publish_plane(plane_update(++number, 1, 1));
    broker.start();
    const MqttClient client(broker.port(), {kTopics.plane});
    EXPECT_TRUE(connects(*link));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    names = planes_of(client);
  }
  ASSERT_FALSE(names.empty());
  EXPECT_EQ(names[0], "whole" + std::to_string(number) + ".0");
}

TEST_F(MqttLinkTest, AStalledBrokerGetsTheNewestPlaneWholeAndDescriptorsBetween) {
  Broker broker;
  const auto link = started({.uri = broker.uri("venue/attic")});
  ASSERT_TRUE(connects(*link));
  MqttClient client(broker.port(), {kTopics.plane, kTopics.descriptor});
  link->publish_plane(plane_update(0, 1, 1));
  ASSERT_TRUE(client.newest(kTopics.plane));
  broker.process().signal(SIGSTOP);
  constexpr int kLast = 400;
  for (int number = 1; number <= kLast; ++number) {
    link->publish_plane(plane_update(number, 3, 3, kMaxPlaneMessageBytes));
    link->publish(bytes_of("descriptor " + std::to_string(number)));
  }
  broker.process().signal(SIGCONT);
  const std::string last = "whole" + std::to_string(kLast) + ".2";
  EXPECT_TRUE(becomes_true("the newest plane is there, whole", [&] { return planes_of(client).back() == last; }))
      << planes_of(client).back();
  EXPECT_TRUE(becomes_true("the newest descriptor is there", [&] {
    return client.newest(kTopics.descriptor)->payload == "descriptor " + std::to_string(kLast);
  }));
  EXPECT_LT(client.count(kTopics.plane), 1000U) << "80 MB were queued for a broker that does not read";
}

TEST_F(MqttLinkTest, ABrokerWithATooSmallLimitIsReported) {
  Broker broker({.more = "max_packet_size 20000\n"});
  const auto link = started({.uri = broker.uri("venue/attic")});
  ASSERT_TRUE(connects(*link));
  link->publish_plane(plane_update(1, 1, 1, 30'000));
  EXPECT_TRUE(becomes_true("the limit is reported", [&] {
    return link->error_message().find("max_packet_size") != std::string::npos;
  })) << link->error_message();
  EXPECT_EQ(link->counters().clients, 1U) << "descriptors are published";
  MqttClient client(broker.port(), {kTopics.plane, kTopics.descriptor});
  link->publish(bytes_of("small"));
  EXPECT_EQ(client.newest(kTopics.descriptor)->payload, "small");
  link->publish_plane(plane_update(2, 1, 1, 10'000));
  ASSERT_TRUE(client.newest(kTopics.plane));
  EXPECT_EQ(planes_of(client).back(), "whole2.0");
  EXPECT_EQ(link->error_message(), "");
}

TEST_F(MqttLinkTest, StopsWithinASecondAlsoWithAStalledBroker) {
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

TEST_F(MqttLinkTest, ConnectsWithTlsAndAPassword) {
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

  const auto expect_rejected = [&](const MqttConfig& wrong, const std::string& reason) {
    const auto link = started(wrong);
    EXPECT_TRUE(becomes_true("the error message has: " + reason, [&] {
      return link->error_message().find(reason) != std::string::npos;
    })) << link->error_message();
    EXPECT_EQ(link->counters().clients, 0U);
  };
  MqttConfig wrong = config;
  wrong.login_file = folder.write("wrong", "attic\nguess\n");
  expect_rejected(wrong, "authori");
  wrong = config;
  const Authority other("elsewhere");
  wrong.ca_file = other.certificate();
  expect_rejected(wrong, "certificate verify failed");
  wrong = config;
  wrong.certificate_file = wrong.key_file = {};
  expect_rejected(wrong, "a certificate of ours");
}

TEST_F(MqttLinkTest, RejectsABrokerWithAnExpiredCertificateOrAnotherName) {
  const Authority authority("venue");
  for (const KeyPair& bad :
       {authority.sign("old", "IP:127.0.0.1", -1), authority.sign("other", "DNS:elsewhere.example")}) {
    Broker broker({.tls = bad});
    const auto link = started({.uri = broker.uri("venue/attic"), .ca_file = authority.certificate()});
    EXPECT_TRUE(becomes_true("the error message has the reason", [&] {
      return link->error_message().find("certificate verify failed") != std::string::npos;
    })) << link->error_message();
    EXPECT_EQ(link->counters().clients, 0U);
  }
}

TEST_F(MqttLinkTest, StartFailsWithAnInvalidConfiguration) {
  const auto start_error = [&](const MqttConfig& config) {
    return make_mqtt_link(config, "attic", commands_)->start();
  };
  EXPECT_EQ(start_error({.uri = "mqtt://broker/venue/+"}).code(), StatusCode::invalid_argument);
  const Status missing = start_error({.uri = "mqtts://broker/venue/attic", .ca_file = "/no/such.pem"});
  EXPECT_EQ(missing.code(), StatusCode::not_found);
  EXPECT_THAT(missing.message(), HasSubstr("/no/such.pem"));
  const TempDir folder;
  const Status plain =
      start_error({.uri = "mqtt://broker/venue/attic", .login_file = folder.write("login", "ann\nx\n")});
  EXPECT_THAT(plain.message(), HasSubstr("LINK_SECURITY_PLAIN"));
  const Status empty =
      start_error({.uri = "mqtts://broker/venue/attic", .login_file = folder.write("login", "\nsecret\n")});
  EXPECT_THAT(empty.message(), HasSubstr("user name"));
}

}  // namespace
}  // namespace lightwell::test
