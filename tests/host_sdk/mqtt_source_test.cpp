// The MQTT connection against a fake probe at a real broker.
#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/discover.hpp>
#include <lightwell/mqtt_session.hpp>

#include "host_sdk/probe_at_broker.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(MqttSource, ReceivesDescriptorsMappedToTheHostsClock) {
  Broker broker;
  ProbeAtBroker attic(broker);
  attic.say_alive();
  const Result<Probe> probe = Probe::connect(broker.uri("venue/attic"), patient());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  const ProbeInfo info = probe->info();
  EXPECT_EQ(info.name, "attic");
  EXPECT_EQ(info.version, "0.1.0");
  EXPECT_NEAR(info.clock_offset.seconds(), 3600, info.clock_uncertainty.seconds());
  EXPECT_GT(info.clock_uncertainty.ns, 0);
  EXPECT_TRUE(becomes_true("connected", [&] { return probe->stats().state == LinkState::connected; }));
  for (std::uint64_t i = 1; i <= 20; ++i) attic.say(attic.descriptor(i, 20 * kMs));
  ASSERT_TRUE(newest_becomes(*probe, 20));
  const Lighting light = probe->latest();
  EXPECT_EQ(light.validity(), Validity::valid);
  EXPECT_GE(light.age().ns, 20 * kMs - info.clock_uncertainty.ns);
  EXPECT_GT(light.age_uncertainty().ns, 0) << "the clock uncertainty is reported with the age";
  EXPECT_EQ(probe->stats().received, 20U);
  EXPECT_EQ(probe->stats().gaps, 0U);
  EXPECT_EQ(probe->stats().last_error, "");
}

TEST(MqttSource, RetainedDescriptorHasItsAge) {
  Broker broker;
  ProbeAtBroker attic(broker);
  attic.say_alive();
  attic.say(attic.descriptor(7, 3'000 * kMs));
  ProbeOptions options = patient();
  options.max_age = {1'000 * kMs};
  const Result<Probe> probe = Probe::connect(broker.uri("venue/attic"), options);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(newest_becomes(*probe, 7));
  EXPECT_EQ(probe->latest().validity(), Validity::stale);
  EXPECT_GE(probe->latest().age().ns, 3'000 * kMs - probe->info().clock_uncertainty.ns);
}

TEST(MqttSource, WithoutTheProbesClockConnectFails) {
  Broker broker;
  ProbeAtBroker attic(broker);
  attic.answers = false;
  attic.say_alive();
  attic.say(attic.descriptor(7, 0));
  ProbeOptions options = patient();
  int taken = 0;
  options.on_descriptor = [&](const Arrival&) { ++taken; };
  options.connect_timeout = {2'500 * kMs};
  const Result<Probe> probe = Probe::connect(broker.uri("venue/attic"), options);
  ASSERT_FALSE(probe.ok());
  EXPECT_EQ(probe.status().code(), StatusCode::unavailable);
  EXPECT_THAT(probe.status().message(), HasSubstr("does not report its clock"));
  EXPECT_EQ(taken, 0);
  EXPECT_GE(attic.clock_requests, 2) << "the clock was requested again";
}

TEST(MqttSource, ConnectReportsAGoneOrUnknownProbe) {
  Broker broker;
  ProbeAtBroker attic(broker);
  ProbeOptions options = patient();
  options.connect_timeout = {1'500 * kMs};
  EXPECT_THAT(Probe::connect(broker.uri("venue/attic"), options).status().message(),
              HasSubstr("no probe has published"));
  attic.say(attic.descriptor(7, 0));
  attic.say_gone();
  const Status gone = Probe::connect(broker.uri("venue/attic"), options).status();
  EXPECT_EQ(gone.code(), StatusCode::unavailable);
  EXPECT_THAT(gone.message(), HasSubstr("the probe has left venue/attic"));
}

TEST(MqttSource, LastWillMakesLightStaleUntilTheProbeIsBack) {
  Broker broker;
  ProbeAtBroker attic(broker);
  attic.say_alive();
  ProbeOptions options = patient();
  options.max_age = {500 * kMs};
  const Result<Probe> probe = Probe::connect(broker.uri("venue/attic"), options);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  attic.say(attic.descriptor(1'000, 0));
  ASSERT_TRUE(newest_becomes(*probe, 1'000));
  attic.say_gone();
  EXPECT_TRUE(becomes_true("the link reports it", [&] { return probe->stats().state == LinkState::gone; }));
  EXPECT_TRUE(becomes_true("the light is stale", [&] { return probe->latest().validity() == Validity::stale; }));
  EXPECT_THAT(probe->stats().last_error, HasSubstr("has left"));
  attic.say(attic.descriptor(1'001, 0));
  attic.offset_ns = 5'000 * kMs - monotonic_now_ns();  // it rebooted: five seconds since
  attic.say_alive();
  EXPECT_TRUE(
      becomes_true("descriptors are received again", [&] { return probe->stats().state == LinkState::connected; }));
  EXPECT_EQ(probe->latest().descriptor().sequence, 1'000U) << "a descriptor is not accepted while the clock is unknown";
  attic.say(attic.descriptor(1, 10 * kMs));
  ASSERT_TRUE(newest_becomes(*probe, 1));
  EXPECT_LT(probe->latest().age().ns, 60'000 * kMs);
  EXPECT_GE(probe->stats().reconnects, 1U);
}

TEST(MqttSource, ReconnectsToTheBroker) {
  Broker broker;
  auto attic = std::make_unique<ProbeAtBroker>(broker);
  attic->say_alive();
  const Result<Probe> probe = Probe::connect(broker.uri("venue/attic"), patient());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  attic->say(attic->descriptor(1, 0));
  ASSERT_TRUE(newest_becomes(*probe, 1));
  broker.stop();
  EXPECT_TRUE(becomes_true("the loss is noticed", [&] { return probe->stats().state == LinkState::waiting; }));
  EXPECT_EQ(probe->latest().descriptor().sequence, 1U) << "the last light stays";
  broker.start();
  attic = std::make_unique<ProbeAtBroker>(broker);
  attic->say_alive();
  EXPECT_TRUE(becomes_true("the link is back", [&] { return probe->stats().state == LinkState::connected; }));
  attic->say(attic->descriptor(2, 0));
  EXPECT_TRUE(newest_becomes(*probe, 2));
  EXPECT_EQ(probe->stats().reconnects, 1U);
}

TEST(MqttSource, StalledBrokerIsReportedAndClosesWithinASecond) {
  Broker broker;
  ProbeAtBroker attic(broker);
  attic.say_alive();
  ProbeOptions options = patient();
  options.silence_limit = {2'000 * kMs};
  options.max_age = {500 * kMs};
  std::optional<Probe> probe;
  {
    Result<Probe> made = Probe::connect(broker.uri("venue/attic"), options);
    ASSERT_TRUE(made.ok()) << made.status().message();
    probe.emplace(std::move(*made));
  }
  attic.say(attic.descriptor(1, 0));
  ASSERT_TRUE(newest_becomes(*probe, 1));
  broker.process().signal(SIGSTOP);
  EXPECT_TRUE(becomes_true("the silence is reported", [&] { return probe->stats().state == LinkState::waiting; }));
  EXPECT_THAT(probe->stats().last_error, HasSubstr("no data"));
  EXPECT_EQ(probe->latest().validity(), Validity::stale);
  const std::int64_t begin = monotonic_now_ns();
  probe.reset();
  EXPECT_LT(monotonic_now_ns() - begin, 1'500 * kMs);
  broker.process().signal(SIGCONT);
}

TEST(MqttSource, DestructorWaitsForASlowCallback) {
  Broker broker;
  ProbeAtBroker attic(broker);
  attic.say_alive();
  ProbeOptions options = patient();
  std::atomic<int> begun{0}, ended{0};
  options.on_descriptor = [&](const Arrival&) {
    ++begun;
    std::this_thread::sleep_for(std::chrono::milliseconds(1'500));
    ++ended;
  };
  {
    const Result<Probe> probe = Probe::connect(broker.uri("venue/attic"), options);
    ASSERT_TRUE(probe.ok()) << probe.status().message();
    attic.say(attic.descriptor(1, 0));
    ASSERT_TRUE(becomes_true("the callback runs", [&] { return begun == 1; }));
  }
  EXPECT_EQ(ended, 1) << "nothing of ours runs when the probe is gone";
}

TEST(MqttSource, AcceptsNoCommands) {
  Broker broker;
  ProbeAtBroker attic(broker);
  attic.say_alive();
  Result<Probe> probe = Probe::connect(broker.uri("venue/attic"), patient());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  for (const Status& refused :
       {probe->set_estimator({}), probe->estimator_config().status(), probe->report_lux(500, {0, 1, 0}).status()}) {
    EXPECT_EQ(refused.code(), StatusCode::failed_precondition);
    EXPECT_THAT(refused.message(), HasSubstr("grpc://"));
  }
}

TEST(MqttSource, ALoginGoesOverPlainTextOnlyWhereTheAddressAsksForIt) {
  // A documentation address (RFC 5737): the rejection happens before any connection attempt.
  ProbeOptions options = patient();
  options.mqtt.user = "ann";
  options.mqtt.password = "s3cret";
  const Status s = Probe::connect("mqtt://192.0.2.1/venue/attic", options).status();
  EXPECT_EQ(s.code(), StatusCode::invalid_argument);
  EXPECT_THAT(s.message(), AllOf(HasSubstr("mqtts://"), HasSubstr("/venue/attic?security=plain")));
  EXPECT_EQ(discover({.broker = "mqtt://192.0.2.1/venue", .credentials = options.mqtt}).status().code(),
            StatusCode::invalid_argument);
  options.connect_timeout = {100 * kMs};
  EXPECT_EQ(Probe::connect("mqtt://192.0.2.1/venue/attic?security=plain", options).status().code(),
            StatusCode::unavailable);
  // The session checks the login itself, whoever created it.
  std::string lost;
  MqttSession::Options session;
  session.address = *parse_mqtt_address("mqtt://192.0.2.1/venue/attic");
  session.login = {"ann", "ann", "s3cret", {}, {}, {}};
  session.retry_min = session.retry_max = session.connect_timeout = {kMs};
  session.on_lost = [&](const std::string& why) { lost = why; };
  MqttSession(session).run_once({kMs});
  EXPECT_THAT(lost, HasSubstr("?security=plain"));
}

TEST(MqttSource, ConnectsOnlyWithTlsAndPassword) {
  const Authority authority("venue"), other("elsewhere");
  Broker broker({.tls = authority.sign("broker"), .client_ca = authority.certificate(), .users = {{"ann", "s3cret"}}});
  const KeyPair own = authority.sign("headset");
  ProbeOptions options = patient();
  options.connect_timeout = {1'500 * kMs};
  options.mqtt = {.ca_file = authority.certificate(),
                  .certificate_file = own.certificate,
                  .key_file = own.key,
                  .user = "ann",
                  .password = "s3cret"};
  const auto said = [&](const ProbeOptions& o) {
    return Probe::connect(broker.uri("venue/attic"), o).status().message();
  };
  // There is no probe, but the broker accepted the connection.
  EXPECT_THAT(said(options), HasSubstr("no probe has published"));
  ProbeOptions wrong = options;
  wrong.mqtt.password = "guess";
  EXPECT_THAT(said(wrong), HasSubstr("authori"));
  wrong = options;
  wrong.mqtt.ca_file = other.certificate();
  EXPECT_THAT(said(wrong), HasSubstr("certificate verify failed"));
  wrong = options;
  wrong.mqtt.certificate_file = wrong.mqtt.key_file = {};
  EXPECT_THAT(said(wrong), HasSubstr("a certificate of ours"));
  wrong.mqtt.ca_file = "/no/such.pem";
  EXPECT_THAT(said(wrong), HasSubstr("/no/such.pem"));
}

TEST(MqttSource, RejectsABrokerWithAnExpiredOrForeignCertificate) {
  const Authority authority("venue");
  for (const KeyPair& bad :
       {authority.sign("old", "IP:127.0.0.1", -1), authority.sign("other", "DNS:elsewhere.example")}) {
    Broker broker({.tls = bad});
    ProbeOptions options = patient();
    options.connect_timeout = {1'500 * kMs};
    options.mqtt.ca_file = authority.certificate();
    EXPECT_THAT(Probe::connect(broker.uri("venue/attic"), options).status().message(),
                HasSubstr("certificate verify failed"));
  }
}

TEST(MqttSource, InvalidAddressIsRejectedAtOnce) {
  for (const char* bad : {"mqtt://127.0.0.1/venue/+", "mqtt://127.0.0.1/#", "mqtt://127.0.0.1"})
    EXPECT_EQ(Probe::connect(bad).status().code(), StatusCode::invalid_argument) << bad;
  ProbeOptions options;
  options.mqtt.password = "without a user";
  EXPECT_EQ(Probe::connect("mqtt://127.0.0.1/a", options).status().code(), StatusCode::invalid_argument);
}

}  // namespace
}  // namespace lightwell::test
