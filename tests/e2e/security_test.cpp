// Authenticated clients over TLS, from pairing to light, with child processes.
#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/secrets.hpp>

#include "e2e/secure_daemon.hpp"
#include "link/access/client_list.hpp"
#include "link/access/probe_keys.hpp"
#include "support/impairing_proxy.hpp"
#include "support/read_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class SecurityTest : public SecureDaemonTest {
 protected:
  [[nodiscard]] ProbeCredentials pinned() const {
    ProbeCredentials c;
    c.pinned = read_file(keys() + "/ca.pem");
    return c;
  }
  /// The message of connect() when the handshake fails.
  static std::string handshake_refusal(const std::string& uri, const ProbeCredentials& credentials) {
    const Result<Probe> probe = connect(uri, credentials);
    EXPECT_FALSE(probe.ok());
    if (probe.ok()) return {};
    EXPECT_EQ(probe.status().code(), StatusCode::unavailable);
    EXPECT_THAT(probe.status().message(), HasSubstr(uri));
    return probe.status().message();
  }
  /// A daemon with a certificate provided by its owner.
  DaemonOptions showing(const std::string& certificate, const std::string& key) const {
    const std::string config = folder_.write(
        "probe.textproto", "camera { uri: \"sim:" + folder_.path("room.exr") +
                               "\" }\ngrpc { security: LINK_SECURITY_TLS key_folder: \"keys\" certificate: \"own.pem\" "
                               "key: \"own_key.pem\" }\n");
    folder_.write("own.pem", certificate);
    folder_.write("own_key.pem", key);
    return {.more = {"--config", config}};
  }
  /// Makes a certificate for localhost with openssl, as an owner would.
  DaemonOptions showing_what_openssl_made() const {
    Child openssl({"/usr/bin/openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes",
                   "-days", "2", "-subj", "/CN=attic", "-addext", "subjectAltName=DNS:localhost", "-keyout",
                   folder_.path("k"), "-out", folder_.path("c")});
    EXPECT_EQ(openssl.wait(), (ExitStatus{0, 0})) << openssl.err();
    return showing(read_file(folder_.path("c")), read_file(folder_.path("k")));
  }
  /// Adds a client to the daemon's list without pairing; returns its token.
  [[nodiscard]] std::string token(std::int64_t expires_in_s) const {
    const std::string token = to_base64url(*random_bytes(32));
    EXPECT_TRUE(ClientList::add(keys() + "/clients",
                                {to_hex(sha256(token)), "", std::time(nullptr) + expires_in_s, "x"},
                                std::time(nullptr) - 1'000'000)
                    .ok());
    return token;
  }
};

/// All bytes that an eavesdropper records in both directions.
std::string recorded_by(const ImpairingProxy& proxy) {
  std::string out;
  for (const Direction direction : {Direction::to_server, Direction::to_client})
    for (const std::byte b : proxy.carried(direction)) out.push_back(static_cast<char>(b));
  return out;
}

TEST_F(SecurityTest, AfterPairingTheAddressIsEnough) {
  Daemon daemon(options("tls"));
  const std::string folder = pair(daemon.uri());
  Child info(tool({"info", daemon.uri(), "--json"}), environment());
  EXPECT_EQ(info.wait(), (ExitStatus{0, 0})) << info.err();
  EXPECT_THAT(info.out(), HasSubstr("\"authentication_failures\":0"));
  Child watch(tool({"watch", daemon.uri(), "--seconds", "1"}), environment());
  EXPECT_EQ(watch.wait(), (ExitStatus{0, 0})) << watch.err();
  Result<Probe> probe = connect(daemon.uri(), folder);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(gets_light(*probe));
  EXPECT_TRUE(probe->set_estimator({}).ok());
}

TEST_F(SecurityTest, AMistakeInTheListOfClientsIsInTheLogAndInInfo) {
  Daemon daemon(options("tls"));
  // Connects once, so that the daemon has read the list with this client.
  ASSERT_TRUE(connect(daemon.uri(), pair(daemon.uri())).ok());
  std::ofstream(keys() + "/clients", std::ios::app) << "a slip of the hand\n";
  EXPECT_TRUE(becomes_true("the log names the line", [&] {
    return daemon.process().err().find("clients:4: the first word is not a SHA-256") != std::string::npos;
  })) << daemon.process().err();
  Child info(tool({"info", daemon.uri(), "--json"}), environment());
  EXPECT_EQ(info.wait(), (ExitStatus{0, 0})) << info.err();
  EXPECT_THAT(info.out(), HasSubstr("\"client_list_faults\":1"));
}

TEST_F(SecurityTest, AnEavesdropperLearnsNoSecret) {
  Daemon daemon(options("tls"));
  PairingMode mode(keys(), "tls", port_of(daemon.uri()));
  const ImpairingProxy pairing(port_of(mode.uri())), link(port_of(daemon.uri()));
  const std::string code = mode.code(), folder = pair(mode, pairing.port());
  const Result<Probe> probe = connect("grpcs://127.0.0.1:" + std::to_string(link.port()), folder);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(gets_light(*probe));
  const std::string recorded = recorded_by(pairing) + recorded_by(link);
  ASSERT_GT(recorded_by(pairing).size(), 2000U) << "certificates and messages went through";
  ASSERT_GT(recorded_by(link).size(), 2000U);
  const auto first_line = [&](const char* file) {
    const std::string text = read_file(folder + "/" + file);
    return text.substr(0, text.find('\n'));
  };
  const auto body = [](const std::string& pem) { return pem.substr(pem.find('\n') + 1, 64); };
  const std::string token = first_line("token");
  ASSERT_EQ(token.size(), kTokenLength);
  for (const std::string& secret : {token, body(read_file(folder + "/client_key.pem")),
                                    body(read_file(keys() + "/ca_key.pem")), body(read_file(keys() + "/probe_key.pem")),
                                    std::string("lightwell.v1.ProbeService"), std::string("authorization")})
    for (const std::string& form : {secret, to_hex(secret), to_base64url(secret), sha256(secret)})
      EXPECT_THAT(recorded, Not(HasSubstr(form))) << secret;
  // The six digits of the code occur in the random bytes by chance about once in 10^10 runs.
  for (const std::string& form : {code, to_hex(code), to_base64url(code)}) EXPECT_THAT(recorded, Not(HasSubstr(form)));
}

TEST_F(SecurityTest, TheSameSearchFindsUnencryptedData) {
  Daemon daemon({.camera = "sim:" + folder_.path("room.exr"), .more = {"--name", "attic"}});
  const ImpairingProxy link(port_of(daemon.uri()));
  const Result<Probe> probe = connect("grpc://127.0.0.1:" + std::to_string(link.port()), ProbeCredentials());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_THAT(recorded_by(link), AllOf(HasSubstr("lightwell.v1.ProbeService"), HasSubstr("attic")));
}

TEST_F(SecurityTest, AWrongCodeIsRejectedAndThreeEndThePairing) {
  PairingMode mode(keys(), "tls", 7420);
  std::string wrong = mode.code();
  wrong.front() = wrong.front() == '0' ? '1' : '0';
  for (int i = 0; i < 3; ++i) {
    Child tool_run(tool({"pair", mode.uri(), "--code", wrong}), environment());
    EXPECT_EQ(tool_run.wait(), (ExitStatus{4, 0}));
    EXPECT_THAT(tool_run.err(), HasSubstr("the code is not the one"));
  }
  EXPECT_EQ(mode.process().wait(), (ExitStatus{1, 0}));
  EXPECT_THAT(mode.process().err(), HasSubstr("three wrong codes"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path("config/lightwell")));
}

TEST_F(SecurityTest, MutualTlsServesAPairedClientAndGivesOthersAHint) {
  Daemon daemon(options("mutual-tls"));
  const std::string folder = pair(daemon.uri(), "mutual-tls");
  const Result<Probe> probe = connect(daemon.uri(), folder);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(gets_light(*probe));
  ProbeCredentials token_alone = pinned();
  token_alone.token = token(3600);
  EXPECT_THAT(handshake_refusal(daemon.uri(), token_alone), HasSubstr("LINK_SECURITY_MUTUAL_TLS"));
}

TEST_F(SecurityTest, AllInvalidTokensGetTheSameError) {
  Daemon daemon(options("tls"));
  (void)daemon.uri();
  ProbeCredentials good = pinned(), expired = pinned(), wrong = pinned();
  good.token = token(3600);
  expired.token = token(-3600);
  wrong.token = std::string(kTokenLength, 'x');
  EXPECT_TRUE(connect(daemon.uri(), good).ok());
  std::string said;
  for (const ProbeCredentials& bad : {pinned(), wrong, expired}) {
    const std::string now = handshake_refusal(daemon.uri(), bad);
    EXPECT_THAT(now, HasSubstr("lightwell pair"));
    EXPECT_TRUE(said.empty() || said == now) << now;
    said = now;
  }
}

TEST_F(SecurityTest, AProbeWithAnotherPinEndsInTheHandshake) {
  Daemon daemon(options("tls"));
  ProbeCredentials other = pinned();
  const KeyPair key = *KeyPair::make();
  other.pinned = *issue_certificate(
      {CertificateUse::authority, "x", key.public_pem, kDefaultNotBefore_s, std::time(nullptr) + 3600},
      {{}, key.private_pem});
  EXPECT_THAT(
      handshake_refusal(daemon.uri(), other),
      AllOf(HasSubstr("TLS handshake failed"), HasSubstr("trusted authority"), HasSubstr("pair with it again")));
}

TEST_F(SecurityTest, AnExpiredCertificateEndsInTheHandshake) {
  const KeyPair ca = *KeyPair::make(), key = *KeyPair::make();
  const std::int64_t now = std::time(nullptr);
  const CertifiedKey issuer{
      *issue_certificate({CertificateUse::authority, "x", ca.public_pem, kDefaultNotBefore_s, now + 3600},
                         {{}, ca.private_pem}),
      ca.private_pem};
  ProbeCredentials trusting;
  trusting.pinned = issuer.certificate;
  trusting.token = std::string(kTokenLength, 'x');
  {
    Daemon daemon(
        showing(*issue_certificate({CertificateUse::probe, "x", key.public_pem, kDefaultNotBefore_s, now - 60}, issuer),
                key.private_pem));
    EXPECT_THAT(handshake_refusal(daemon.uri(), trusting),
                AllOf(HasSubstr("TLS handshake failed"), HasSubstr("expired")));
  }
  {
    Daemon daemon(showing(
        *issue_certificate({CertificateUse::client, "x", key.public_pem, kDefaultNotBefore_s, now + 60}, issuer),
        key.private_pem));
    EXPECT_THAT(handshake_refusal(daemon.uri(), trusting), HasSubstr("TLS handshake failed"))
        << "a client's certificate of the same authority must not be accepted as a probe's";
  }
  Daemon daemon(
      showing(*issue_certificate({CertificateUse::probe, "x", key.public_pem, kDefaultNotBefore_s, now + 60}, issuer),
              key.private_pem));
  EXPECT_THAT(handshake_refusal(daemon.uri(), trusting), HasSubstr("lightwell pair"))
      << "the same certificate before its expiry passes the handshake";
}

TEST_F(SecurityTest, WithAPublicAuthorityTheCertificateMustNameTheHost) {
  Daemon daemon(options("tls"));
  (void)daemon.uri();
  ProbeCredentials c;
  c.ca = read_file(keys() + "/ca.pem");
  c.token = token(3600);
  // The probe's own certificate names probe.lightwell.internal and no address.
  EXPECT_FALSE(connect(daemon.uri(), c).ok());
  ProbeCredentials p = c;
  std::swap(p.ca, p.pinned);
  EXPECT_TRUE(connect(daemon.uri(), p).ok()) << "pinned, the address does not matter";
}

TEST_F(SecurityTest, APublicAuthorityIsTrustedForTheHostThatTheCertificateNames) {
  Daemon daemon(showing_what_openssl_made());
  const std::string port = std::to_string(port_of(daemon.uri()));
  ProbeCredentials c;
  c.ca = read_file(folder_.path("c"));
  c.token = token(3600);
  const Result<Probe> probe = connect("grpcs://localhost:" + port, c);
  EXPECT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_FALSE(connect("grpcs://127.0.0.1:" + port, c).ok()) << "the certificate does not name this address";
}

TEST_F(SecurityTest, PairingPinsTheOwnersCertificate) {
  const DaemonOptions own = showing_what_openssl_made();
  Daemon daemon(own);
  PairingMode mode(own.more, port_of(daemon.uri()));
  const std::string folder = pair(mode);
  EXPECT_EQ(read_file(folder + "/probe_ca.pem"), read_file(folder_.path("c")));
  const Result<Probe> probe = connect(daemon.uri(), folder);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(gets_light(*probe));
}

TEST_F(SecurityTest, TheClientReconnectsAfterARestart) {
  std::string folder, uri;
  {
    Daemon daemon(options("tls"));
    uri = daemon.uri();
    folder = pair(uri);
  }
  const std::string listen = uri.substr(std::string("grpcs://").size());
  auto daemon = std::make_unique<Daemon>(options("tls", listen));
  ASSERT_EQ(daemon->uri(), uri);
  const Result<Probe> probe = connect(uri, folder);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(gets_light(*probe));
  daemon->process().signal(SIGKILL);
  (void)daemon->process().wait();
  ASSERT_TRUE(becomes_true("the link is lost", [&] { return probe->stats().state != LinkState::connected; }));
  daemon = std::make_unique<Daemon>(options("tls", listen));
  ASSERT_EQ(daemon->uri(), uri);
  ASSERT_TRUE(becomes_true("the client has reconnected", [&] { return probe->stats().reconnects == 1; }));
  EXPECT_TRUE(gets_light(*probe));
  // Another probe with other keys at the same address: the client must not connect to it.
  daemon.reset();
  std::filesystem::remove_all(keys());
  daemon = std::make_unique<Daemon>(options("tls", listen));
  ASSERT_EQ(daemon->uri(), uri);
  ASSERT_TRUE(becomes_true("the handshake fails", [&] {
    return probe->stats().last_error.find("TLS handshake failed") != std::string::npos;
  }));
  EXPECT_EQ(probe->stats().reconnects, 1U);
}

TEST_F(SecurityTest, IPv6Works) {
  Daemon plain({.camera = "sim:" + folder_.path("room.exr"), .listen = "[::1]:0"});
  EXPECT_THAT(plain.uri(), HasSubstr("grpc://[::1]:"));
  EXPECT_TRUE(connect(plain.uri(), ProbeCredentials()).ok());
  Daemon guarded(options("tls", "[::]:0"));
  const std::string port = std::to_string(port_of(guarded.uri()));
  const std::string folder = pair(guarded.uri());
  for (const std::string host : {"[::1]:", "127.0.0.1:"}) {
    const Result<Probe> probe = connect("grpcs://" + host + port, folder);
    ASSERT_TRUE(probe.ok()) << probe.status().message();
    EXPECT_TRUE(gets_light(*probe));
  }
}

TEST_F(SecurityTest, UnencryptedLinksAndPairingOnANetworkAreRejected) {
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--check"}, {"--pair"}}) {
    DaemonOptions o{.camera = "sim:" + folder_.path("room.exr"), .listen = "0.0.0.0:0", .more = more};
    Child child(daemon_command(o));
    EXPECT_EQ(child.wait(), (ExitStatus{1, 0}));
    EXPECT_THAT(child.err(), AllOf(HasSubstr("LINK_SECURITY_TLS"), HasSubstr("--security")));
    EXPECT_EQ(child.out(), "");
  }
}

TEST_F(SecurityTest, CredentialsAreNotSentUnencrypted) {
  Daemon daemon({.camera = "sim:" + folder_.path("room.exr")});
  ProbeCredentials c;
  c.pinned = "-----BEGIN CERTIFICATE-----\n";
  c.token = "secret";
  const Result<Probe> probe = connect(daemon.uri(), c);
  ASSERT_FALSE(probe.ok());
  EXPECT_EQ(probe.status().code(), StatusCode::invalid_argument);
  EXPECT_THAT(probe.status().message(), HasSubstr("grpcs://"));
}

}  // namespace
}  // namespace lightwell::test
