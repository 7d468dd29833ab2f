// Who is let in, over real TLS.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <fstream>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/link/guarded_probe.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class GrpcSecurityTest : public GuardedProbeTest {
 protected:
  /// In a moment, or not at all: a handshake that fails is tried again by gRPC for as long as it may.
  static grpc::Status ask(const std::shared_ptr<grpc::Channel>& channel, const std::string& authorization = {}) {
    return call(channel, kInfo, "", authorization).status;
  }
  static ::testing::AssertionResult fails_in_the_handshake(const std::shared_ptr<grpc::Channel>& channel) {
    const grpc::Status s = ask(channel);
    if (s.error_code() != grpc::StatusCode::UNAVAILABLE)
      return ::testing::AssertionFailure() << s.error_code() << ": " << s.error_message();
    return ::testing::AssertionSuccess();
  }
};

TEST_F(GrpcSecurityTest, ATokenOpensTheDoor) {
  listen(LinkSecurity::tls);
  const KnownClient client = known_client();
  EXPECT_THAT(link_->address(), HasSubstr("grpcs://"));
  EXPECT_TRUE(ask(channel(), "Bearer " + client.given.token).ok());
  RawStream stream(
      connect(*link_, grpc::CompositeChannelCredentials(grpc::SslCredentials({keys().trust, "", ""}),
                                                        grpc::AccessTokenCredentials(client.given.token))));
  ASSERT_TRUE(becomes_true("the stream is there", [&] { return link_->counters().clients == 1; }));
  link_->publish(message(7));
  EXPECT_EQ(stream.next(), text_of(message(7)));
  EXPECT_EQ(link_->counters().authentication_failures, 0U);
}

TEST_F(GrpcSecurityTest, ACertificateOpensTheDoorWithoutAToken) {
  listen(LinkSecurity::tls);
  EXPECT_TRUE(ask(channel_of(known_client())).ok());
}

TEST_F(GrpcSecurityTest, NoTokenAWrongOneAndAnExpiredOneAreRefusedAlike) {
  listen(LinkSecurity::tls);
  const std::string good = known_client().given.token, expired = known_client(-1).given.token;
  std::string nearly = good;
  nearly.back() = nearly.back() == 'A' ? 'B' : 'A';
  const std::shared_ptr<grpc::Channel> one = channel();
  std::set<std::pair<int, std::string>> answers;
  const std::vector<std::string> bad = {"",
                                        "Bearer ",
                                        "Bearer x",
                                        "Bearer " + nearly,
                                        "Bearer " + expired,
                                        "Bearer " + good + good,
                                        good,
                                        "Basic " + good,
                                        "bearer" + good,
                                        "Bearer " + std::string(4000, 'x')};
  for (const std::string& authorization : bad) {
    const grpc::Status s = ask(one, authorization);
    answers.emplace(s.error_code(), s.error_message());
    EXPECT_EQ(s.error_details(), "") << authorization;
  }
  ASSERT_EQ(answers.size(), 1U) << "they cannot be told apart";
  EXPECT_EQ(answers.begin()->first, grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(answers.begin()->second, AllOf(HasSubstr("lightwell pair"), Not(HasSubstr("expired"))));
  EXPECT_EQ(link_->counters().authentication_failures, bad.size());
  EXPECT_TRUE(ask(one, "Bearer " + good).ok()) << "the good one is still good";
}

TEST_F(GrpcSecurityTest, NoTokenAWrongOneAndAnExpiredOneTakeTheSameTime) {
  listen(LinkSecurity::tls);
  const std::string expired = known_client(-1).given.token;
  // Others on the list, so that finding one early or late could show.
  for (int i = 0; i < 20; ++i) (void)known_client();
  const std::array<std::string, 3> kinds = {"", "Bearer " + std::string(kTokenLength, 'x'), "Bearer " + expired};
  std::array<std::vector<double>, 3> took;
  const std::shared_ptr<grpc::Channel> one = channel();
  (void)ask(one);
  constexpr int kRounds = 400;
  for (int i = 0; i < kRounds; ++i)
    // In turns, and each kind as often first: what the machine does otherwise meets all three.
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      const std::size_t kind = (k + static_cast<std::size_t>(i)) % kinds.size();
      const auto start = std::chrono::steady_clock::now();
      const grpc::Status s = ask(one, kinds[kind]);
      took[kind].push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
      ASSERT_EQ(s.error_code(), grpc::StatusCode::UNAUTHENTICATED);
    }
  std::array<double, 3> median{};
  double spread = 1e9;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    std::sort(took[k].begin(), took[k].end());
    median[k] = took[k][kRounds / 2];
    spread = std::min(spread, took[k][3 * kRounds / 4] - took[k][kRounds / 4]);
  }
  const auto [least, most] = std::minmax_element(median.begin(), median.end());
  RecordProperty("medians_us",
                 std::to_string(median[0]) + " " + std::to_string(median[1]) + " " + std::to_string(median[2]));
  std::printf("medians %.0f, %.0f, %.0f us, quartiles %.0f us apart\n", median[0], median[1], median[2], spread);
  EXPECT_LT(*most - *least, spread);
}

TEST_F(GrpcSecurityTest, HealthNeedsNoTokenAndReflectionDoes) {
  listen(LinkSecurity::tls);
  EXPECT_EQ(call(channel(), "/grpc.health.v1.Health/Check", "").bytes, "\x08\x01");
  RawStream stream(channel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                   std::string("\x3a\x00", 2));
  EXPECT_FALSE(stream.next());
  EXPECT_EQ(stream.end().error_code(), grpc::StatusCode::UNAUTHENTICATED);
}

TEST_F(GrpcSecurityTest, EveryMethodOfTheProbeIsGuarded) {
  listen(LinkSecurity::tls);
  const std::shared_ptr<grpc::Channel> one = channel();
  for (const char* method : {"Info", "GetDescriptor", "SetConfig", "ReportLux", "StreamDescriptors", "NoSuchMethod"})
    EXPECT_EQ(call(one, std::string("/lightwell.v1.ProbeService/") + method, "").status.error_code(),
              grpc::StatusCode::UNAUTHENTICATED)
        << method;
}

TEST_F(GrpcSecurityTest, AClientWhoseLineIsCutIsShutOutAtOnce) {
  listen(LinkSecurity::tls);
  const KnownClient client = known_client();
  const std::shared_ptr<grpc::Channel> by_token = channel(), by_certificate = channel_of(client);
  ASSERT_TRUE(ask(by_token, "Bearer " + client.given.token).ok());
  ASSERT_TRUE(ask(by_certificate).ok());
  std::ofstream(folder_.path("keys/clients")) << "# nobody\n";
  EXPECT_EQ(ask(by_token, "Bearer " + client.given.token).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(ask(by_certificate).error_code(), grpc::StatusCode::UNAUTHENTICATED);
}

TEST_F(GrpcSecurityTest, ACertificateThatIsNotGoodEndsInTheHandshake) {
  listen(LinkSecurity::tls);
  const ProbeKeys own = keys();
  const KnownClient good = known_client();
  const Issuer issuer{own.issuer_certificate, own.issuer_key};
  const auto expired =
      issue_certificate({CertificateUse::client, "x", good.key.public_pem, kDefaultNotBefore_s, now() - 60}, issuer);
  const auto not_yet =
      issue_certificate({CertificateUse::client, "x", good.key.public_pem, now() + 3600, now() + 7200}, issuer);
  // Signed by itself: the very thing that anyone can make.
  const auto stranger = issue_certificate({CertificateUse::client, "x", good.key.public_pem, kDefaultNotBefore_s, now() + 3600},
                                          {{}, good.key.private_pem});
  ASSERT_TRUE(expired.ok() && not_yet.ok() && stranger.ok());
  for (const std::string& certificate : {*expired, *not_yet, *stranger})
    EXPECT_TRUE(fails_in_the_handshake(channel(certificate, good.key.private_pem)));
  EXPECT_TRUE(fails_in_the_handshake(channel(own.certificate, own.key))) << "the probe's own is none for clients";
  EXPECT_EQ(link_->counters().authentication_failures, 0U) << "no call came as far as that";
  EXPECT_TRUE(ask(channel_of(good)).ok());
}

TEST_F(GrpcSecurityTest, TheCertificateIsRenewedWhileAStreamRuns) {
  std::atomic<std::int64_t> probes_clock = now() - 365 * 86'400;
  listen(LinkSecurity::tls, "127.0.0.1:0", [&] { return probes_clock.load(); });
  const KnownClient client = known_client();
  RawStream stream(
      connect(*link_, grpc::CompositeChannelCredentials(grpc::SslCredentials({keys().trust, "", ""}),
                                                        grpc::AccessTokenCredentials(client.given.token))));
  ASSERT_TRUE(becomes_true("the stream is there", [&] { return link_->counters().clients == 1; }));
  const auto shown_until = [&] {
    const Result<CertificateInfo> facts = read_certificate(call(channel_of(client), kInfo, "").certificate);
    EXPECT_TRUE(facts.ok());
    return facts ? facts->not_after_s : 0;
  };
  EXPECT_EQ(shown_until(), probes_clock + 2 * 365 * 86'400);
  probes_clock += 500 * 86'400;  // more than two thirds of two years are over
  EXPECT_EQ(shown_until(), probes_clock + 2 * 365 * 86'400);
  link_->publish(message(7));
  EXPECT_EQ(stream.next(), text_of(message(7))) << "the stream from before goes on";
  EXPECT_EQ(link_->counters().clients, 1U);
  EXPECT_EQ(link_->error_message(), "");
}

TEST_F(GrpcSecurityTest, ABoardWhoseClockWasYearsBehindIsReachedAsSoonAsItIsSet) {
  std::atomic<std::int64_t> probes_clock = now() - 3 * 365 * 86'400;
  listen(LinkSecurity::tls, "127.0.0.1:0", [&] { return probes_clock.load(); });
  const KnownClient client = known_client();
  EXPECT_TRUE(fails_in_the_handshake(channel_of(client))) << "by the client's clock the certificate has expired";
  probes_clock = now();
  EXPECT_TRUE(ask(channel_of(client)).ok());
}

TEST_F(GrpcSecurityTest, AMistakeInTheListOfClientsShutsNobodyOutAndIsSaidAndCounted) {
  listen(LinkSecurity::tls);
  const KnownClient client = known_client();
  ASSERT_TRUE(ask(channel(), "Bearer " + client.given.token).ok());
  std::ofstream(folder_.path("keys/clients"), std::ios::app) << "a slip of the hand\n";
  EXPECT_TRUE(ask(channel(), "Bearer " + client.given.token).ok());
  EXPECT_TRUE(ask(channel_of(client)).ok());
  EXPECT_EQ(link_->counters().client_list_faults, 1U);
  EXPECT_THAT(link_->error_message(), AllOf(HasSubstr("clients:4: "), HasSubstr("correct or delete the line")));
}

TEST_F(GrpcSecurityTest, MutualTlsWantsACertificateAndATokenDoesNotHelp) {
  listen(LinkSecurity::mutual_tls);
  const KnownClient client = known_client();
  EXPECT_TRUE(ask(channel_of(client)).ok());
  const grpc::Status refused = ask(channel(), "Bearer " + client.given.token);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAVAILABLE) << "in the handshake: " << refused.error_message();
}

TEST_F(GrpcSecurityTest, AClientThatSpeaksPlainTextGetsNoAnswer) {
  listen(LinkSecurity::tls);
  EXPECT_EQ(ask(connect(*link_)).error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(GrpcSecurityTest, AProbeOfAnotherAuthorityIsRefusedByTheClient) {
  listen(LinkSecurity::tls);
  GrpcConfig other;
  other.keys = folder_.path("other");
  const Result<ProbeKeys> elsewhere = load_probe_keys(other, "cellar", now());
  ASSERT_TRUE(elsewhere.ok());
  const grpc::Status s = ask(connect(*link_, grpc::SslCredentials({elsewhere->trust, "", ""})));
  EXPECT_EQ(s.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(s.error_message(), HasSubstr("certificate verify failed"));
}

TEST_F(GrpcSecurityTest, PlainTextBeyondTheLoopbackIsRefusedUnlessItIsAskedForByName) {
  for (const std::string listen : {"0.0.0.0:0", "[::]:0", "192.0.2.1:7420", "127.evil.example:0"}) {
    const Status s = make_grpc_link({.listen = listen}, "attic", commands_)->start();
    EXPECT_EQ(s.code(), StatusCode::failed_precondition) << listen;
    EXPECT_THAT(s.message(), AllOf(HasSubstr(listen), HasSubstr("LINK_SECURITY_TLS"), HasSubstr("--security plain")));
  }
  for (const std::string listen : {"127.0.0.1:0", "127.1.2.3:0", "[::1]:0", "localhost:0"}) {
    const Status s = make_grpc_link({.listen = listen}, "attic", commands_)->start();
    EXPECT_TRUE(s.ok()) << listen << ": " << s.message();
  }
  EXPECT_TRUE(
      make_grpc_link({.listen = "0.0.0.0:0", .security = LinkSecurity::plain}, "attic", commands_)->start().ok());
}

TEST_F(GrpcSecurityTest, IPv6IsServedAndTheWildcardServesBoth) {
  listen(LinkSecurity::tls, "[::]:0");
  const std::string port = link_->address().substr(link_->address().rfind(':'));
  const std::string token = known_client().given.token;
  for (const std::string host : {"[::1]", "127.0.0.1"}) {
    grpc::ChannelArguments arguments;
    arguments.SetSslTargetNameOverride(kProbeHostName);
    EXPECT_TRUE(ask(grpc::CreateCustomChannel(host + port, grpc::SslCredentials({keys().trust, "", ""}), arguments),
                    "Bearer " + token)
                    .ok())
        << host;
  }
}

TEST_F(GrpcSecurityTest, OnTheIPv6LoopbackAPlainProbeAnswers) {
  const std::unique_ptr<Link> link = make_grpc_link({.listen = "[::1]:0"}, "attic", commands_);
  ASSERT_TRUE(link->start().ok());
  EXPECT_THAT(link->address(), HasSubstr("grpc://[::1]:"));
  EXPECT_TRUE(ask(connect(*link)).ok());
}

}  // namespace
}  // namespace lightwell::test
