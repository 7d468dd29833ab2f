// Authentication and authorization of the gRPC link over real TLS.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <fstream>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/quantile.hpp>

#include "firmware/link/guarded_probe.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class GrpcSecurityTest : public GuardedProbeTest {
 protected:
  /// The status of an Info call. gRPC repeats a failed handshake until the deadline of the call.
  static grpc::Status call_info(const std::shared_ptr<grpc::Channel>& channel, const std::string& authorization = {}) {
    return call(channel, kInfo, "", authorization).status;
  }
  static ::testing::AssertionResult fails_in_the_handshake(const std::shared_ptr<grpc::Channel>& channel) {
    const grpc::Status s = call_info(channel);
    if (s.error_code() != grpc::StatusCode::UNAVAILABLE)
      return ::testing::AssertionFailure() << s.error_code() << ": " << s.error_message();
    return ::testing::AssertionSuccess();
  }
};

TEST_F(GrpcSecurityTest, AcceptsAToken) {
  listen(LinkSecurity::tls);
  const PairedClient client = pair_client();
  EXPECT_THAT(link_->address(), HasSubstr("grpcs://"));
  EXPECT_TRUE(call_info(channel(), "Bearer " + client.credentials.token).ok());
  RawStream stream(
      connect(*link_, grpc::CompositeChannelCredentials(grpc::SslCredentials({keys().trust, "", ""}),
                                                        grpc::AccessTokenCredentials(client.credentials.token))));
  ASSERT_TRUE(becomes_true("the stream is registered", [&] { return link_->counters().clients == 1; }));
  link_->publish(message(7));
  EXPECT_EQ(stream.next(), text_of(message(7)));
  EXPECT_EQ(link_->counters().authentication_failures, 0U);
}

TEST_F(GrpcSecurityTest, AcceptsACertificateWithoutAToken) {
  listen(LinkSecurity::tls);
  EXPECT_TRUE(call_info(channel_of(pair_client())).ok());
}

TEST_F(GrpcSecurityTest, MissingWrongAndExpiredTokensGetTheSameError) {
  listen(LinkSecurity::tls);
  const std::string good = pair_client().credentials.token, expired = pair_client(-1).credentials.token;
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
    const grpc::Status s = call_info(one, authorization);
    answers.emplace(s.error_code(), s.error_message());
    EXPECT_EQ(s.error_details(), "") << authorization;
  }
  ASSERT_EQ(answers.size(), 1U) << "the errors must be identical";
  EXPECT_EQ(answers.begin()->first, grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(answers.begin()->second, AllOf(HasSubstr("lightwell pair"), Not(HasSubstr("expired"))));
  EXPECT_EQ(link_->counters().authentication_failures, bad.size());
  EXPECT_TRUE(call_info(one, "Bearer " + good).ok()) << "the valid token is still accepted";
}

TEST_F(GrpcSecurityTest, MissingWrongAndExpiredTokensTakeTheSameTime) {
  listen(LinkSecurity::tls);
  const std::string expired = pair_client(-1).credentials.token;
  // More clients on the list, so that the position of a match could affect the time.
  for (int i = 0; i < 20; ++i) (void)pair_client();
  const std::array<std::string, 3> kinds = {"", "Bearer " + std::string(kTokenLength, 'x'), "Bearer " + expired};
  std::array<std::vector<double>, 3> took;
  const std::shared_ptr<grpc::Channel> one = channel();
  (void)call_info(one);
  constexpr int kRounds = 400;
  for (int i = 0; i < kRounds; ++i)
    // The kinds alternate, each first equally often, so that load on the machine affects all three alike.
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      const std::size_t kind = (k + static_cast<std::size_t>(i)) % kinds.size();
      const auto start = std::chrono::steady_clock::now();
      const grpc::Status s = call_info(one, kinds[kind]);
      took[kind].push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
      ASSERT_EQ(s.error_code(), grpc::StatusCode::UNAUTHENTICATED);
    }
  std::array<double, 3> median{};
  double spread = 1e9;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    median[k] = upper_quantile(took[k], 0.5);
    spread = std::min(spread, upper_quantile(took[k], 0.75) - upper_quantile(took[k], 0.25));
  }
  const auto [least, most] = std::minmax_element(median.begin(), median.end());
  RecordProperty("medians_us",
                 std::to_string(median[0]) + " " + std::to_string(median[1]) + " " + std::to_string(median[2]));
  std::printf("medians %.0f, %.0f, %.0f us, quartiles %.0f us apart\n", median[0], median[1], median[2], spread);
  // The client itself takes some microseconds more to send a header, so that a tenth of a call is within tolerance.
  EXPECT_LT(*most - *least, std::max(spread, 0.1 * *least));
}

TEST_F(GrpcSecurityTest, HealthNeedsNoTokenAndReflectionDoes) {
  listen(LinkSecurity::tls);
  EXPECT_EQ(call(channel(), "/grpc.health.v1.Health/Check", "").bytes, "\x08\x01");
  RawStream stream(channel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                   std::string("\x3a\x00", 2));
  EXPECT_FALSE(stream.next());
  EXPECT_EQ(stream.end().error_code(), grpc::StatusCode::UNAUTHENTICATED);
}

TEST_F(GrpcSecurityTest, EveryMethodNeedsAuthorization) {
  listen(LinkSecurity::tls);
  const std::shared_ptr<grpc::Channel> one = channel();
  for (const char* method :
       {"Info", "GetDescriptor", "SetConfig", "ReportLux", "StreamDescriptors", "StreamPlane", "NoSuchMethod"})
    EXPECT_EQ(call(one, std::string("/lightwell.v1.ProbeService/") + method, "").status.error_code(),
              grpc::StatusCode::UNAUTHENTICATED)
        << method;
}

TEST_F(GrpcSecurityTest, ADeletedClientIsRefusedAtOnce) {
  listen(LinkSecurity::tls);
  const PairedClient client = pair_client();
  const std::shared_ptr<grpc::Channel> by_token = channel(), by_certificate = channel_of(client);
  ASSERT_TRUE(call_info(by_token, "Bearer " + client.credentials.token).ok());
  ASSERT_TRUE(call_info(by_certificate).ok());
  std::ofstream(folder_.path("keys/clients")) << "# nobody\n";
  EXPECT_EQ(call_info(by_token, "Bearer " + client.credentials.token).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(call_info(by_certificate).error_code(), grpc::StatusCode::UNAUTHENTICATED);
}

TEST_F(GrpcSecurityTest, AnInvalidCertificateFailsTheHandshake) {
  listen(LinkSecurity::tls);
  const ProbeKeys own = keys();
  const PairedClient good = pair_client();
  const CertifiedKey issuer{own.issuer_certificate, own.issuer_key};
  const auto expired =
      issue_certificate({CertificateUse::client, "x", good.key.public_pem, kDefaultNotBefore_s, now() - 60}, issuer);
  const auto not_yet =
      issue_certificate({CertificateUse::client, "x", good.key.public_pem, now() + 3600, now() + 7200}, issuer);
  // Self-signed: anyone can create one.
  const auto stranger =
      issue_certificate({CertificateUse::client, "x", good.key.public_pem, kDefaultNotBefore_s, now() + 3600},
                        {{}, good.key.private_pem});
  ASSERT_TRUE(expired.ok() && not_yet.ok() && stranger.ok());
  for (const std::string& certificate : {*expired, *not_yet, *stranger})
    EXPECT_TRUE(fails_in_the_handshake(channel(certificate, good.key.private_pem)));
  EXPECT_TRUE(fails_in_the_handshake(channel(own.certificate, own.key)))
      << "the probe's certificate is not valid for clients";
  EXPECT_EQ(link_->counters().authentication_failures, 0U) << "no call reached the authorizer";
  EXPECT_TRUE(call_info(channel_of(good)).ok());
}

TEST_F(GrpcSecurityTest, TheCertificateIsRenewedWhileAStreamRuns) {
  std::atomic<std::int64_t> probe_clock = now() - 365 * 86'400;
  listen(LinkSecurity::tls, "127.0.0.1:0", [&] { return probe_clock.load(); });
  const PairedClient client = pair_client();
  RawStream stream(
      connect(*link_, grpc::CompositeChannelCredentials(grpc::SslCredentials({keys().trust, "", ""}),
                                                        grpc::AccessTokenCredentials(client.credentials.token))));
  ASSERT_TRUE(becomes_true("the stream is registered", [&] { return link_->counters().clients == 1; }));
  const auto certificate_expiry = [&] {
    const Result<CertificateIdentity> info = identify_certificate(call(channel_of(client), kInfo, "").certificate);
    EXPECT_TRUE(info.ok());
    return info ? info->expires_s : 0;
  };
  EXPECT_EQ(certificate_expiry(), probe_clock + 2 * 365 * 86'400);
  probe_clock += 500 * 86'400;  // More than two thirds of two years have passed.
  EXPECT_EQ(certificate_expiry(), probe_clock + 2 * 365 * 86'400);
  link_->publish(message(7));
  EXPECT_EQ(stream.next(), text_of(message(7))) << "the existing stream continues";
  EXPECT_EQ(link_->counters().clients, 1U);
  EXPECT_EQ(link_->error_message(), "");
}

TEST_F(GrpcSecurityTest, ABoardIsReachableAsSoonAsItsClockIsSet) {
  std::atomic<std::int64_t> probe_clock = now() - 3 * 365 * 86'400;
  listen(LinkSecurity::tls, "127.0.0.1:0", [&] { return probe_clock.load(); });
  const PairedClient client = pair_client();
  EXPECT_TRUE(fails_in_the_handshake(channel_of(client))) << "by the client's clock the certificate has expired";
  probe_clock = now();
  EXPECT_TRUE(call_info(channel_of(client)).ok());
}

TEST_F(GrpcSecurityTest, AnErrorInTheClientListIsReportedAndKeepsThePreviousList) {
  listen(LinkSecurity::tls);
  const PairedClient client = pair_client();
  ASSERT_TRUE(call_info(channel(), "Bearer " + client.credentials.token).ok());
  std::ofstream(folder_.path("keys/clients"), std::ios::app) << "an invalid line\n";
  EXPECT_TRUE(call_info(channel(), "Bearer " + client.credentials.token).ok());
  EXPECT_TRUE(call_info(channel_of(client)).ok());
  EXPECT_EQ(link_->counters().client_list_faults, 1U);
  EXPECT_THAT(link_->error_message(), AllOf(HasSubstr("clients:4: "), HasSubstr("correct or delete the line")));
}

TEST_F(GrpcSecurityTest, MutualTlsRequiresACertificateEvenWithAToken) {
  listen(LinkSecurity::mutual_tls);
  const PairedClient client = pair_client();
  EXPECT_TRUE(call_info(channel_of(client)).ok());
  const grpc::Status refused = call_info(channel(), "Bearer " + client.credentials.token);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAVAILABLE) << "in the handshake: " << refused.error_message();
}

TEST_F(GrpcSecurityTest, APlainTextClientFails) {
  listen(LinkSecurity::tls);
  EXPECT_EQ(call_info(connect(*link_)).error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(GrpcSecurityTest, TheClientRejectsAProbeOfAnotherAuthority) {
  listen(LinkSecurity::tls);
  GrpcConfig other;
  other.key_folder = folder_.path("other");
  const Result<ProbeKeys> elsewhere = load_probe_keys(other, "cellar", now());
  ASSERT_TRUE(elsewhere.ok());
  const grpc::Status s = call_info(connect(*link_, grpc::SslCredentials({elsewhere->trust, "", ""})));
  EXPECT_EQ(s.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(s.error_message(), HasSubstr("certificate verify failed"));
}

TEST_F(GrpcSecurityTest, PlainTextBeyondLoopbackNeedsAnExplicitChoice) {
  for (const std::string listen : {"0.0.0.0:0", "[::]:0", "192.0.2.1:7420", "127.evil.example:0"}) {
    const Status s = make_grpc_link({.listen_address = listen}, "attic", commands_)->start();
    EXPECT_EQ(s.code(), StatusCode::failed_precondition) << listen;
    EXPECT_THAT(s.message(), AllOf(HasSubstr(listen), HasSubstr("LINK_SECURITY_TLS"), HasSubstr("--security plain")));
  }
  for (const std::string listen : {"127.0.0.1:0", "127.1.2.3:0", "[::1]:0", "localhost:0"}) {
    const Status s = make_grpc_link({.listen_address = listen}, "attic", commands_)->start();
    EXPECT_TRUE(s.ok()) << listen << ": " << s.message();
  }
  EXPECT_TRUE(make_grpc_link({.listen_address = "0.0.0.0:0", .security = LinkSecurity::plain}, "attic", commands_)
                  ->start()
                  .ok());
}

TEST_F(GrpcSecurityTest, TheIPv6WildcardServesIPv4Too) {
  listen(LinkSecurity::tls, "[::]:0");
  const std::string port = link_->address().substr(link_->address().rfind(':'));
  const std::string token = pair_client().credentials.token;
  for (const std::string host : {"[::1]", "127.0.0.1"}) {
    grpc::ChannelArguments arguments;
    arguments.SetSslTargetNameOverride(kProbeHostName);
    EXPECT_TRUE(
        call_info(grpc::CreateCustomChannel(host + port, grpc::SslCredentials({keys().trust, "", ""}), arguments),
                  "Bearer " + token)
            .ok())
        << host;
  }
}

TEST_F(GrpcSecurityTest, ServesPlainTextOnTheIPv6Loopback) {
  const std::unique_ptr<Link> link = make_grpc_link({.listen_address = "[::1]:0"}, "attic", commands_);
  ASSERT_TRUE(link->start().ok());
  EXPECT_THAT(link->address(), HasSubstr("grpc://[::1]:"));
  EXPECT_TRUE(call_info(connect(*link)).ok());
}

}  // namespace
}  // namespace lightwell::test
