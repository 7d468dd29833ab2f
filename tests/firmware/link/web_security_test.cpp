// Authentication of the web link over real TLS.
#include <atomic>
#include <set>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/link/web_probe.hpp"
#include "link/access/client_list.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// Whether the client receives the newest descriptor or a published one.
::testing::AssertionResult receives(RawWebClient& client, Link& link) {
  link.publish(message(7));
  const std::optional<std::string> got = client.next();
  if (got == text_of(message(7))) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << (got ? *got : "nothing");
}

TEST_F(GuardedWebTest, ATokenInTheHandshakeIsAccepted) {
  listen(LinkSecurity::tls);
  EXPECT_THAT(link_->address(), StartsWith("wss://"));
  RawWebClient client(*link_, trusting());
  ASSERT_EQ(client.upgrade("/v1/descriptors", bearer(pair_client().credentials.token)).status, 101);
  EXPECT_TRUE(receives(client, *link_));
  EXPECT_EQ(link_->counters().authentication_failures, 0U);
}

TEST_F(GuardedWebTest, AClientCertificateIsAcceptedWithoutAToken) {
  listen(LinkSecurity::tls);
  RawWebClient client(*link_, showing(pair_client()));
  ASSERT_EQ(client.upgrade().status, 101);
  EXPECT_TRUE(receives(client, *link_));
  EXPECT_EQ(RawWebClient(*link_, showing(pair_client())).request("GET /metrics HTTP/1.1").status, 200);
}

TEST_F(GuardedWebTest, BrowsersAuthenticateByTheirFirstMessage) {
  listen(LinkSecurity::tls);
  link_->publish(message(7));
  RawWebClient client(*link_, trusting());
  ASSERT_EQ(client.upgrade().status, 101);
  EXPECT_EQ(client.next(std::chrono::milliseconds(200)), std::nullopt) << "nothing is sent before";
  EXPECT_EQ(link_->counters().clients, 0U);
  client.send_frame(authenticate_request(pair_client().credentials.token, 9));
  const Result<LinkResponse> response = response_in(client.next());
  ASSERT_TRUE(response.ok()) << response.status().message();
  EXPECT_TRUE(response->status.ok());
  EXPECT_EQ(response->id, 9U);
  EXPECT_EQ(client.next(), text_of(message(7))) << "the newest descriptor";
  client.send_frame(info_request(10));
  EXPECT_TRUE(response_in(client.next()).ok());
  EXPECT_EQ(link_->counters().clients, 1U);
}

TEST_F(GuardedWebTest, MissingWrongAndExpiredTokensGetTheSameAnswer) {
  listen(LinkSecurity::tls);
  const std::string good = pair_client().credentials.token, expired = pair_client(-1).credentials.token;
  std::string nearly = good;
  nearly.back() = nearly.back() == 'A' ? 'B' : 'A';
  std::set<std::pair<int, std::string>> closes;
  for (const std::string& first :
       {authenticate_request(nearly), authenticate_request(expired), authenticate_request(""),
        authenticate_request(good.substr(1)), info_request(1), std::string("noise")}) {
    RawWebClient client(*link_, trusting());
    ASSERT_EQ(client.upgrade().status, 101);
    client.send_frame(first);
    const std::optional<WebFrame> close = client.next_frame();
    ASSERT_TRUE(close && close->opcode == Opcode::close);
    closes.emplace(close->close_code(), close->payload.substr(2));
  }
  ASSERT_EQ(closes.size(), 1U) << "the answers must be identical";
  EXPECT_EQ(closes.begin()->first, 1008);
  EXPECT_THAT(closes.begin()->second, AllOf(HasSubstr("lightwell pair"), Not(HasSubstr("expired"))));
  EXPECT_EQ(link_->counters().authentication_failures, 6U);
}

TEST_F(GuardedWebTest, AWrongTokenInTheHandshakeIsRefused) {
  listen(LinkSecurity::tls);
  const std::string expired = pair_client(-1).credentials.token;
  std::set<std::string> bodies;
  for (const std::string value : {"Bearer x", "Bearer ", "Basic abc", "x"}) {
    const HttpReply reply =
        RawWebClient(*link_, trusting()).upgrade("/v1/descriptors", "Authorization: " + value + "\r\n");
    EXPECT_EQ(reply.status, 401) << value;
    EXPECT_THAT(reply.head, HasSubstr("www-authenticate: Bearer"));
    bodies.insert(reply.body);
  }
  bodies.insert(RawWebClient(*link_, trusting()).upgrade("/v1/descriptors", bearer(expired)).body);
  EXPECT_EQ(RawWebClient(*link_, trusting()).upgrade("/v1/descriptors", bearer(std::string(3000, 'x'))).status, 401);
  EXPECT_EQ(bodies.size(), 1U);
  EXPECT_EQ(link_->counters().authentication_failures, 6U);
}

TEST_F(GuardedWebTest, AClientThatSendsNoTokenIsClosed) {
  listen(LinkSecurity::tls);
  RawWebClient client(*link_, trusting());
  ASSERT_EQ(client.upgrade().status, 101);
  const auto start = std::chrono::steady_clock::now();
  const std::optional<WebFrame> close = client.close_frame();
  ASSERT_TRUE(close);
  EXPECT_EQ(close->close_code(), 1008);
  EXPECT_GT(std::chrono::steady_clock::now() - start, std::chrono::seconds(4));
  EXPECT_EQ(link_->counters().authentication_failures, 1U);
}

TEST_F(GuardedWebTest, MetricsNeedATokenAndHealthAndPagesDoNot) {
  listen(LinkSecurity::tls);
  const std::string token = pair_client().credentials.token;
  EXPECT_EQ(RawWebClient(*link_, trusting()).request("GET /healthz HTTP/1.1").status, 200);
  EXPECT_EQ(RawWebClient(*link_, trusting()).request("GET / HTTP/1.1").status, 200);
  EXPECT_EQ(RawWebClient(*link_, trusting()).request("GET /metrics HTTP/1.1").status, 401);
  EXPECT_EQ(RawWebClient(*link_, trusting()).request("GET /metrics HTTP/1.1\r\nAuthorization: Bearer x").status, 401);
  const HttpReply metrics =
      RawWebClient(*link_, trusting()).request("GET /metrics HTTP/1.1\r\nAuthorization: Bearer " + token);
  EXPECT_EQ(metrics.status, 200);
  EXPECT_THAT(metrics.body, HasSubstr("lightwell_frames_total"));
  EXPECT_EQ(link_->counters().authentication_failures, 2U);
}

TEST_F(GuardedWebTest, ManyFailuresFromAnAddressAreLimited) {
  listen(LinkSecurity::tls);
  const std::string token = pair_client().credentials.token;
  int last = 0;
  for (int i = 0; i < 30 && last != 429; ++i)
    last = RawWebClient(*link_, trusting()).upgrade("/v1/descriptors", bearer("wrong")).status;
  ASSERT_EQ(last, 429);
  EXPECT_LE(link_->counters().authentication_failures, 20U);
  // From then on tokens are not looked at, for about a second.
  EXPECT_TRUE(becomes_true("the right token is accepted again", [&] {
    RawWebClient client(*link_, trusting());
    return client.upgrade("/v1/descriptors", bearer(token)).status == 101;
  }));
}

TEST_F(GuardedWebTest, WithMutualTlsTheHandshakeNeedsACertificate) {
  listen(LinkSecurity::mutual_tls);
  const WebPairedClient client = pair_client();
  RawWebClient without(*link_, trusting());
  // With TLS 1.3 the client's handshake ends before the server has looked for its certificate.
  EXPECT_EQ(without.connected() ? without.upgrade().status : 0, 0);
  RawWebClient with(*link_, showing(client));
  ASSERT_EQ(with.upgrade().status, 101);
  EXPECT_TRUE(receives(with, *link_));
}

TEST_F(GuardedWebTest, ACertificateOfAStrangerFailsInTheHandshake) {
  listen(LinkSecurity::tls);
  const Result<KeyPair> key = KeyPair::make();
  ASSERT_TRUE(key.ok());
  const Result<std::string> own = issue_certificate({.use = CertificateUse::client,
                                                     .common_name = "stranger",
                                                     .public_key = key->public_pem,
                                                     .not_after_s = std::time(nullptr) + 1000},
                                                    {"", key->private_pem});
  ASSERT_TRUE(own.ok()) << own.status().message();
  RawWebClient client(*link_, RawTls{keys().trust, *own, key->private_pem});
  EXPECT_EQ(client.connected() ? client.upgrade().status : 0, 0);
}

TEST_F(GuardedWebTest, ADeletedClientIsRefused) {
  listen(LinkSecurity::tls);
  const WebPairedClient client = pair_client();
  ASSERT_EQ(RawWebClient(*link_, showing(client)).upgrade().status, 101);
  folder_.write("keys/clients", "");
  EXPECT_EQ(RawWebClient(*link_, showing(client)).upgrade().status, 401);
  EXPECT_EQ(RawWebClient(*link_, trusting()).upgrade("/v1/descriptors", bearer(client.credentials.token)).status, 401);
}

TEST_F(GuardedWebTest, PlainHttpOnTheTlsPortIsClosed) {
  listen(LinkSecurity::tls);
  RawWebClient client(*link_);
  EXPECT_EQ(client.request("GET /healthz HTTP/1.1").status, 0);
}

TEST_F(GuardedWebTest, AConnectionWithoutHandshakeTimesOut) {
  listen(LinkSecurity::tls);
  RawWebClient silent(*link_);
  EXPECT_TRUE(silent.is_closed_by_peer());
}

TEST_F(GuardedWebTest, ARenewedCertificateIsUsedByTheNextHandshake) {
  // The owner's certificate, replaced under the same key; the link looks at its files once a minute of its clock.
  const Result<KeyPair> key = KeyPair::make();
  ASSERT_TRUE(key.ok());
  const auto certificate = [&](const std::string& name) {
    const Result<std::string> pem = issue_certificate({.use = CertificateUse::probe,
                                                       .common_name = name,
                                                       .public_key = key->public_pem,
                                                       .not_after_s = std::time(nullptr) + 100'000},
                                                      {"", key->private_pem});
    EXPECT_TRUE(pem.ok()) << pem.status().message();
    return pem.ok() ? *pem : std::string();
  };
  const std::string before = certificate("before"), after = certificate("after");
  keys_config_.certificate = folder_.write("own.pem", before);
  keys_config_.key = folder_.write("own_key.pem", key->private_pem);
  keys_config_.security = LinkSecurity::tls;
  keys_config_.key_folder = folder_.path("keys");
  std::atomic<std::int64_t> now{std::time(nullptr)};
  WebConfig config;
  config.listen_address = "127.0.0.1:0";
  config.security = LinkSecurity::tls;
  link_ = make_web_link(config, keys_config_, "attic", commands_, {}, [&now] { return now.load(); });
  ASSERT_TRUE(link_->start().ok());
  ASSERT_TRUE(RawWebClient(*link_, RawTls{before}).connected());
  ASSERT_FALSE(RawWebClient(*link_, RawTls{after}).connected());
  folder_.write("own.pem", after);
  now += 120;
  EXPECT_TRUE(
      becomes_true("the new certificate is shown", [&] { return RawWebClient(*link_, RawTls{after}).connected(); }));
}

}  // namespace
}  // namespace lightwell::test
