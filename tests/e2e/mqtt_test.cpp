// lightwelld and clients at an MQTT broker, as in a venue.
#include <csignal>
#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/mqtt.hpp>

#include "e2e/daemon.hpp"
#include "support/broker.hpp"
#include "support/mqtt_client.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const MqttTopics kTopics("venue/attic");

class MqttTest : public ::testing::Test {
 protected:
  MqttTest() { write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x()); }
  [[nodiscard]] DaemonOptions at(const std::string& uri, std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--mqtt", uri, "--name", "attic"});
    return {.camera = "sim:" + folder_.path("room.exr"), .more = std::move(more)};
  }
  static ::testing::AssertionResult is_at_the_broker(const Broker& broker) {
    const MqttClient client(broker.port(), {kTopics.descriptor});
    return becomes_true("descriptors arrive at the broker", [&] { return client.count(kTopics.descriptor) > 2; });
  }
  static ::testing::AssertionResult state_becomes(const Observer& observer, LinkState state) {
    return becomes_true("the link is " + std::string(to_string(state)),
                        [&] { return observer.probe().stats().state == state; });
  }
  /// Options of an application; older light is stale.
  static Result<Probe> application(const std::string& uri) {
    ProbeOptions options;
    options.max_age = {1'000'000'000};
    options.connect_timeout = {kTestTimeout.count() * 1'000'000};
    return Probe::connect(uri, options);
  }
  static ::testing::AssertionResult grows_stale(const Probe& probe) {
    return becomes_true("the light is stale", [&] { return probe.latest().validity() == Validity::stale; });
  }

  TempDir folder_;
};

TEST_F(MqttTest, ManyClientsGetTheSameBytesAsGrpcClients) {
  Broker broker;
  const std::string uri = broker.uri("venue/attic");
  Daemon daemon(at(uri));
  const Observer direct(daemon.uri());
  ASSERT_TRUE(is_at_the_broker(broker));
  const Observer one(uri), two(uri);
  ASSERT_TRUE(one.gets(20));
  ASSERT_TRUE(two.gets(20));
  EXPECT_EQ(one.probe().info().name, "attic");
  EXPECT_EQ(one.probe().info().camera, direct.probe().info().camera);
  // Both use this machine's clock.
  EXPECT_LE(std::abs(one.probe().info().clock_offset.ns), one.probe().info().clock_uncertainty.ns);
  std::size_t same = 0;
  const auto there = direct.bytes();
  for (const auto& [sequence, bytes] : one.bytes()) {
    const auto other = there.find(sequence);
    if (other == there.end()) continue;
    EXPECT_EQ(bytes, other->second) << sequence;
    ++same;
  }
  EXPECT_GE(same, 15U);
  for (const Observer* observer : {&one, &two}) {
    EXPECT_EQ(observer->probe().stats().undecodable, 0U);
    EXPECT_EQ(observer->probe().stats().untimely, 0U);
  }
}

TEST_F(MqttTest, TheLastWillOfAKilledProbeIsPublishedAndItsLightBecomesStale) {
  Broker broker;
  const std::string uri = broker.uri("venue/attic");
  Daemon daemon(at(uri));
  (void)daemon.uri();
  ASSERT_TRUE(is_at_the_broker(broker));
  const Observer observer(uri);
  const Result<Probe> headset = application(uri);
  ASSERT_TRUE(headset.ok()) << headset.status().message();
  ASSERT_TRUE(becomes_true("the light is valid", [&] { return headset->latest().validity() == Validity::valid; }));
  daemon.process().signal(SIGKILL);
  EXPECT_EQ(daemon.process().wait().signal, SIGKILL);
  EXPECT_TRUE(state_becomes(observer, LinkState::gone));
  EXPECT_TRUE(grows_stale(*headset));
  const MqttClient late(broker.port(), {kTopics.status, kTopics.descriptor});
  EXPECT_EQ(late.newest(kTopics.status)->payload, kMqttGone);
  EXPECT_TRUE(late.newest(kTopics.descriptor)->retained) << "the last descriptor is retained";
  ProbeOptions options;
  options.connect_timeout = {1'000'000'000};
  const Status refused = Probe::connect(uri, options).status();
  EXPECT_THAT(refused.message(), HasSubstr("has left")) << "and is not delivered to new clients";
  Daemon next(at(uri));
  (void)next.uri();
  EXPECT_TRUE(state_becomes(observer, LinkState::connected));
  EXPECT_TRUE(observer.gets(5));
  EXPECT_TRUE(becomes_true("the light is fresh", [&] { return headset->latest().validity() == Validity::valid; }));
}

TEST_F(MqttTest, AStoppedProbePublishesThatItIsGone) {
  Broker broker;
  Daemon daemon(at(broker.uri("venue/attic")));
  (void)daemon.uri();
  ASSERT_TRUE(is_at_the_broker(broker));
  const Observer observer(broker.uri("venue/attic"));
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0})) << daemon.process().err();
  EXPECT_TRUE(state_becomes(observer, LinkState::gone));
}

TEST_F(MqttTest, ProbeAndClientReconnectToARestartedBroker) {
  Broker broker;
  const std::string uri = broker.uri("venue/attic");
  Daemon daemon(at(uri));
  const Observer direct(daemon.uri());
  ASSERT_TRUE(is_at_the_broker(broker));
  const Observer observer(uri);
  const Result<Probe> headset = application(uri);
  ASSERT_TRUE(headset.ok()) << headset.status().message();
  ASSERT_TRUE(observer.gets(3));
  broker.stop();
  EXPECT_TRUE(state_becomes(observer, LinkState::waiting));
  EXPECT_TRUE(grows_stale(*headset));
  EXPECT_TRUE(direct.gets(10)) << "other links are not affected";
  broker.start();
  EXPECT_TRUE(state_becomes(observer, LinkState::connected));
  EXPECT_TRUE(observer.gets(5));
  EXPECT_EQ(observer.probe().stats().reconnects, 1U);
  EXPECT_TRUE(becomes_true("the log reports loss and recovery", [&] {
    const std::string said = daemon.process().err();
    return occurrences(said, uri + ": connected") >= 1 && occurrences(said, "it is tried again") >= 1;
  })) << daemon.process().err();
}

TEST_F(MqttTest, StartsWithoutABrokerReportsItAndConnectsLater) {
  Broker broker;
  broker.stop();
  const std::string uri = broker.uri("venue/attic");
  Daemon daemon(at(uri));
  const Observer direct(daemon.uri());
  EXPECT_TRUE(direct.gets(3));
  EXPECT_TRUE(becomes_true("the log says why", [&] {
    return occurrences(daemon.process().err(), uri + ": Connection refused; it is tried again") == 1;
  })) << daemon.process().err();
  EXPECT_THAT(daemon.process().out(), HasSubstr("listening on " + uri));
  broker.start();
  const Observer observer(uri);
  EXPECT_TRUE(observer.gets(5));
}

TEST_F(MqttTest, AStalledClientDoesNotAffectOthers) {
  Broker broker;
  const std::string uri = broker.uri("venue/attic");
  Daemon daemon(at(uri));
  const Observer direct(daemon.uri());
  ASSERT_TRUE(is_at_the_broker(broker));
  Child stalled(tool_command({"watch", uri}));
  ASSERT_TRUE(becomes_true("the client receives light", [&] { return !stalled.out().empty(); })) << stalled.err();
  stalled.signal(SIGSTOP);
  const Observer observer(uri);
  const std::uint64_t coalesced = direct.counters().descriptors_coalesced;
  ASSERT_TRUE(observer.gets(60));
  EXPECT_LE(observer.missing().size(), observer.count() / 10) << "frames may be delayed on a busy machine";
  EXPECT_LE(direct.counters().descriptors_coalesced - coalesced, observer.count() / 10);
  stalled.signal(SIGCONT);
}

TEST_F(MqttTest, HostilePublishersAreCountedAndSurvived) {
  Broker broker;
  const std::string uri = broker.uri("venue/attic");
  Daemon daemon(at(uri));
  (void)daemon.uri();
  ASSERT_TRUE(is_at_the_broker(broker));
  const Observer observer(uri);
  ASSERT_TRUE(observer.gets(5));
  MqttClient mallory(broker.port(), {kTopics.descriptor});
  const std::string old = mallory.newest(kTopics.descriptor)->payload;
  ASSERT_TRUE(observer.gets(5));
  std::uint64_t newest = 0;
  for (int i = 0; i < 30; ++i) {
    mallory.publish(kTopics.descriptor, old, MqttClient::Keep::retained);
    mallory.publish(kTopics.descriptor, std::string(100, static_cast<char>(i)), MqttClient::Keep::retained);
    mallory.publish(kTopics.descriptor, old.substr(0, old.size() / 2));
    mallory.publish(kTopics.descriptor, std::string(kMaxDescriptorBytes + 1, 'x'));
    mallory.publish({kTopics.clock, "", false, kTopics.status, "x"});
    const std::uint64_t sequence = observer.probe().latest().descriptor().sequence;
    EXPECT_GE(sequence, newest) << "an old descriptor replaced a newer one";
    newest = sequence;
  }
  EXPECT_TRUE(becomes_true("replays are counted", [&] { return observer.probe().stats().untimely == 30; }))
      << observer.probe().stats().untimely;
  EXPECT_EQ(observer.probe().stats().oversized, 30U);
  EXPECT_EQ(observer.probe().stats().undecodable, 60U);
  EXPECT_TRUE(observer.gets(5));
  EXPECT_EQ(observer.probe().stats().state, LinkState::connected);
  EXPECT_TRUE(becomes_true("the probe logs the rejected messages", [&] {
    return occurrences(daemon.process().err(), "messages from outside have been refused") == 1;
  })) << daemon.process().err();
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
}

TEST_F(MqttTest, TheReadmesConfigurationWithTlsPasswordsAndAccessRightsWorks) {
  const Authority authority("venue");
  const std::string rights = folder_.write("acl",
                                           "pattern read venue/+/descriptor\npattern read venue/+/status\n"
                                           "pattern write venue/+/clock\npattern read venue/+/clock/reply/#\n"
                                           "user attic\ntopic write venue/attic/#\ntopic read venue/attic/clock\n");
  Broker broker({.tls = authority.sign("broker"),
                 .users = {{"attic", "s3cret"}, {"ann", "guest"}},
                 .more = "acl_file " + rights + "\n"});
  const std::string uri = broker.uri("venue/attic");
  folder_.write("login", "attic\ns3cret\n");
  std::filesystem::copy_file(authority.certificate(), folder_.path("venue-ca.pem"));
  const std::string file =
      folder_.write("probe.textproto", "probe_name: \"attic\"\nmqtt { uri: \"" + uri +
                                           "\" ca_file: \"venue-ca.pem\" login_file: \"login\" }\n");
  Daemon daemon({.camera = "sim:" + folder_.path("room.exr"), .more = {"--config", file}});
  (void)daemon.uri();
  ProbeOptions options;
  options.connect_timeout = {kTestTimeout.count() * 1'000'000};
  options.mqtt = {
      .ca_file = authority.certificate(), .certificate_file = {}, .key_file = {}, .user = "ann", .password = "guest"};
  const Result<Probe> headset = Probe::connect(uri, options);
  ASSERT_TRUE(headset.ok()) << headset.status().message() << daemon.process().err();
  EXPECT_TRUE(becomes_true("descriptors arrive", [&] { return headset->stats().received > 5; }));
  const std::vector<std::string> watch = tool_command({"watch", uri, "--seconds", "1", "--json"});
  Child stranger(watch, {.environment = {"LIGHTWELL_MQTT_CA=" + authority.certificate()}});
  EXPECT_EQ(stranger.wait(), (ExitStatus{3, 0})) << "the broker must reject clients without a password";
  Child guest(watch, {.environment = {"LIGHTWELL_MQTT_CA=" + authority.certificate(),
                                      "LIGHTWELL_MQTT_LOGIN=" + folder_.write("guest", "ann\nguest\n")}});
  EXPECT_EQ(guest.wait(), (ExitStatus{0, 0})) << guest.err();
  EXPECT_THAT(guest.out(), HasSubstr("\"state\":\"connected\""));
}

TEST_F(MqttTest, AnAddressWithAWildcardIsRejected) {
  Child child(daemon_command(at("mqtt://127.0.0.1/venue/+")));
  EXPECT_EQ(child.wait(), (ExitStatus{2, 0}));
  EXPECT_THAT(child.err(), AllOf(HasSubstr("mqtt.uri"), HasSubstr("wildcard")));
}

}  // namespace
}  // namespace lightwell::test
