// The SDK's connection by WebSocket to the firmware's web link, in one process.
#include <atomic>
#include <ctime>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/secrets.hpp>
#include <lightwell/time.hpp>

#include "link/access/probe_keys.hpp"
#include "link/web/web_link.hpp"
#include "support/certificates.hpp"
#include "support/fake_commands.hpp"
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"
#include "support/wait.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

EncodedDescriptor descriptor(std::uint64_t sequence) {
  Descriptor d;
  d.sequence = sequence;
  d.time.mid_exposure = {monotonic_now_ns()};
  d.coverage = 1;
  d.radiance.c[0] = Radiance{1, 1, 1};
  Encoder encoder;
  const auto bytes = encoder.encode(d);
  EXPECT_TRUE(bytes.ok()) << bytes.status().message();
  return std::make_shared<const std::vector<std::byte>>(bytes->begin(), bytes->end());
}

class WebSourceTest : public ::testing::Test {
 protected:
  void start_probe(LinkSecurity security = LinkSecurity::unspecified) {
    WebConfig config;
    config.listen_address = address_;
    config.security = keys_.security = security;
    if (keys_.key_folder.empty()) keys_.key_folder = folder_.path("keys");
    link_ = make_web_link(config, keys_, "attic", commands_, {});
    // The port of a server that was stopped may not be free at once.
    ASSERT_TRUE(becomes_true("the link starts", [&] { return link_->start().ok(); }));
    uri_ = link_->address();
    address_ = uri_.substr(uri_.find("://") + 3);
  }
  [[nodiscard]] static ProbeOptions options() {
    ProbeOptions o;
    o.connect_timeout = Duration::from_seconds(20);
    o.retry_min = {1'000'000};
    o.retry_max = {20'000'000};
    o.max_age = Duration::from_seconds(60);
    return o;
  }
  /// A registered client's credentials, with the probe's own authority pinned.
  [[nodiscard]] ProbeCredentials paired() const {
    const Result<ProbeKeys> keys = load_probe_keys(keys_, "attic", std::time(nullptr));
    EXPECT_TRUE(keys.ok()) << keys.status().message();
    const auto key = lightwell::KeyPair::make();
    const Result<ClientCredentials> client = register_client(*keys, "desk", key->public_pem, 1, std::time(nullptr));
    EXPECT_TRUE(client.ok()) << client.status().message();
    ProbeCredentials out;
    out.pinned = keys->trust;
    out.token = client->token;
    own_certificate_ = client->certificate;
    own_key_ = key->private_pem;
    return out;
  }
  [[nodiscard]] static Result<Probe> connect(const std::string& uri, const ProbeCredentials& credentials) {
    ProbeOptions o = options();
    o.credentials = credentials;
    return Probe::connect(uri, o);
  }
  /// The message of a connection that fails within half a second.
  [[nodiscard]] static std::string failure_of(const std::string& uri, const ProbeCredentials& credentials) {
    ProbeOptions o = options();
    o.connect_timeout = Duration::from_seconds(0.5);
    o.credentials = credentials;
    const Result<Probe> probe = Probe::connect(uri, o);
    return probe.ok() ? "it connected" : probe.status().message();
  }
  [[nodiscard]] ::testing::AssertionResult receives(const Probe& probe, std::uint64_t sequence) {
    link_->publish(descriptor(sequence));
    return becomes_true("descriptor " + std::to_string(sequence) + " arrives", [&] {
      return probe.latest().validity() == Validity::valid && probe.latest().descriptor().sequence == sequence;
    });
  }

  TempDir folder_;
  GrpcConfig keys_;
  FakeCommands commands_;
  std::unique_ptr<Link> link_;
  std::string address_ = "127.0.0.1:0", uri_;
  mutable std::string own_certificate_, own_key_;
};

TEST_F(WebSourceTest, LightAndDescriptionArrive) {
  ASSERT_NO_FATAL_FAILURE(start_probe());
  link_->publish(descriptor(1));
  std::atomic<int> arrived{0};
  ProbeOptions o = options();
  o.on_descriptor = [&](const Arrival& a) {
    // One machine, one clock: the mapped time is that of the exposure.
    EXPECT_NEAR(static_cast<double>(a.mid_exposure.ns), static_cast<double>(a.descriptor.time.mid_exposure.ns), 20e6);
    ++arrived;
  };
  const Result<Probe> probe = Probe::connect(uri_, o);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_EQ(probe->info().name, "attic");
  EXPECT_LT(std::abs(static_cast<double>(probe->info().clock_offset.ns)), 20e6);
  ASSERT_TRUE(becomes_true("the descriptor that was published before", [&] { return arrived == 1; }));
  for (std::uint64_t sequence = 2; sequence < 50; ++sequence) ASSERT_TRUE(receives(*probe, sequence));
  EXPECT_EQ(arrived, 49);
  EXPECT_EQ(probe->stats().gaps, 0U);
  EXPECT_EQ(probe->stats().undecodable, 0U);
  EXPECT_EQ(probe->stats().state, LinkState::connected);
}

TEST_F(WebSourceTest, CommandsAreExecuted) {
  ASSERT_NO_FATAL_FAILURE(start_probe());
  Result<Probe> probe = Probe::connect(uri_, options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EstimatorUpdate update;
  update.panorama.epsilon = 0.07;
  EXPECT_TRUE(probe->change_estimator(update).ok());
  EXPECT_EQ(commands_.estimator().panorama.epsilon, 0.07);
  const Result<EstimatorConfig> config = probe->estimator_config();
  ASSERT_TRUE(config.ok()) << config.status().message();
  EXPECT_EQ(config->panorama.epsilon, 0.07);
  const Result<double> scale = probe->report_lux(500, {0, 1, 0});
  ASSERT_TRUE(scale.ok());
  EXPECT_EQ(*scale, 1000);
}

TEST_F(WebSourceTest, ReconnectsAfterARestartOfTheProbe) {
  ASSERT_NO_FATAL_FAILURE(start_probe());
  ProbeOptions o = options();
  // Long enough to see the reason of the loss before that of the next attempt.
  o.retry_min = o.retry_max = {500'000'000};
  const Result<Probe> probe = Probe::connect(uri_, o);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(receives(*probe, 500));
  link_->stop();
  ASSERT_TRUE(becomes_true("the loss is noticed", [&] { return probe->stats().state == LinkState::waiting; }));
  EXPECT_THAT(probe->stats().last_error, HasSubstr("shutting down"));
  ASSERT_NO_FATAL_FAILURE(start_probe());
  ASSERT_TRUE(becomes_true("it is connected again", [&] { return probe->stats().state == LinkState::connected; }));
  ASSERT_TRUE(becomes_true("it is a client again", [&] { return link_->counters().clients == 1; }));
  // A restarted probe counts from the start.
  EXPECT_TRUE(receives(*probe, 1));
  EXPECT_EQ(probe->stats().reconnects, 1U);
}

TEST_F(WebSourceTest, EndsWithinASecond) {
  ASSERT_NO_FATAL_FAILURE(start_probe());
  for (const std::string& uri : {uri_, std::string("ws://192.0.2.1:7443"), std::string("ws://no.such.host.invalid")}) {
    ProbeOptions o = options();
    o.connect_timeout = Duration::from_seconds(0.3);
    const auto start = std::chrono::steady_clock::now();
    { const Result<Probe> probe = Probe::connect(uri, o); }
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(1800)) << uri;
  }
}

TEST_F(WebSourceTest, ErrorsNameAddressAndRemedy) {
  EXPECT_THAT(failure_of("ws://127.0.0.1:1", {}), HasSubstr("--web"));
  ASSERT_NO_FATAL_FAILURE(start_probe());
  ProbeCredentials token;
  token.ca = "-----BEGIN CERTIFICATE-----";
  token.token = "x";
  EXPECT_THAT(failure_of(uri_, token), HasSubstr("wss://"));
}

TEST_F(WebSourceTest, ATokenIsSentOverTls) {
  ASSERT_NO_FATAL_FAILURE(start_probe(LinkSecurity::tls));
  const Result<Probe> probe = connect(uri_, paired());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(receives(*probe, 1));
  EXPECT_EQ(link_->counters().authentication_failures, 0U);
}

TEST_F(WebSourceTest, ACertificateIsShownToTheProbe) {
  ASSERT_NO_FATAL_FAILURE(start_probe(LinkSecurity::mutual_tls));
  ProbeCredentials c = paired();
  c.token.clear();
  c.client_certificate = own_certificate_;
  c.client_key = own_key_;
  const Result<Probe> probe = connect(uri_, c);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(receives(*probe, 1));
}

TEST_F(WebSourceTest, AWrongTokenIsRefused) {
  ASSERT_NO_FATAL_FAILURE(start_probe(LinkSecurity::tls));
  ProbeCredentials c = paired();
  c.token.back() = c.token.back() == 'A' ? 'B' : 'A';
  EXPECT_THAT(failure_of(uri_, c), HasSubstr("token or certificate"));
  EXPECT_GE(link_->counters().authentication_failures, 1U);
}

TEST_F(WebSourceTest, AnotherProbesCertificateIsRejectedBeforeTheTokenIsSent) {
  ASSERT_NO_FATAL_FAILURE(start_probe(LinkSecurity::tls));
  const ProbeCredentials of_the_first = paired();
  link_->stop();
  keys_.key_folder = folder_.path("other_keys");
  ASSERT_NO_FATAL_FAILURE(start_probe(LinkSecurity::tls));
  EXPECT_THAT(failure_of(uri_, of_the_first), HasSubstr("TLS handshake failed"));
  EXPECT_EQ(link_->counters().authentication_failures, 0U) << "a token would have been counted as wrong";
}

TEST_F(WebSourceTest, APinnedKeyIsAcceptedAtAnyAddressAndAnAuthorityAtItsName) {
  const Authority venue("venue");
  const auto show = [&](const KeyPair& own) {
    keys_.certificate = own.certificate;
    keys_.key = own.key;
  };
  show(venue.sign("attic", "DNS:attic.example"));
  ASSERT_NO_FATAL_FAILURE(start_probe(LinkSecurity::tls));
  ProbeCredentials pinned = paired();
  const std::string token = pinned.token;
  EXPECT_TRUE(connect(uri_, pinned).ok()) << "the name does not matter for a pinned key";
  ProbeCredentials by_authority;
  by_authority.ca = read_file(venue.certificate());
  by_authority.token = token;
  EXPECT_THAT(failure_of(uri_, by_authority), HasSubstr("not valid for 127.0.0.1"));
  by_authority.ca = read_file(Authority("stranger").certificate());
  EXPECT_THAT(failure_of(uri_, by_authority), HasSubstr("did not issue"));
  pinned.pinned = read_file(venue.sign("attic", "DNS:attic.example").certificate);
  EXPECT_THAT(failure_of(uri_, pinned), HasSubstr("not the pinned one"));
  EXPECT_EQ(link_->counters().authentication_failures, 0U);
  link_->stop();
  show(venue.sign("attic", "IP:127.0.0.1"));
  ASSERT_NO_FATAL_FAILURE(start_probe(LinkSecurity::tls));
  by_authority.ca = read_file(venue.certificate());
  EXPECT_TRUE(connect(uri_, by_authority).ok());
  link_->stop();
  show(venue.sign("attic", "IP:127.0.0.1", -1));
  ASSERT_NO_FATAL_FAILURE(start_probe(LinkSecurity::tls));
  EXPECT_THAT(failure_of(uri_, by_authority), HasSubstr("expired"));
}

}  // namespace
}  // namespace lightwell::test
