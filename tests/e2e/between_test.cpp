// Man in the middle: at pairing, one that terminates TLS on both sides, reads and forwards everything; after pairing,
// an impostor with a certificate of the same authority.
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <vector>

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <lightwell/pair.hpp>
#include <lightwell/secrets.hpp>

#include "e2e/secure_daemon.hpp"
#include "lightwell/v1/pairing.grpc.pb.h"
#include "lightwell/v1/probe_service.grpc.pb.h"
#include "link/access/client_list.hpp"
#include "link/access/probe_keys.hpp"
#include "support/read_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Forwards every message unchanged.
class ManInTheMiddle final : public v1::PairingService::Service {
 public:
  ManInTheMiddle(const ProbeKeys& shown, const PairingMode& probe, const std::string& probes_authority) {
    grpc::ChannelArguments arguments;
    arguments.SetSslTargetNameOverride(kProbeHostName);
    onwards_ = v1::PairingService::NewStub(grpc::CreateCustomChannel(probe.uri().substr(std::string("grpcs://").size()),
                                                                     grpc::SslCredentials({probes_authority, "", ""}),
                                                                     arguments));
    grpc::SslServerCredentialsOptions options;
    options.pem_key_cert_pairs.push_back({shown.key, shown.certificate});
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::SslServerCredentials(options), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~ManInTheMiddle() override { server_->Shutdown(std::chrono::system_clock::now()); }

  [[nodiscard]] std::string uri() const { return "grpcs://127.0.0.1:" + std::to_string(port_); }
  int finishes = 0;

  grpc::Status Begin(grpc::ServerContext*, const v1::PairBeginRequest* request,
                     v1::PairBeginResponse* response) override {
    grpc::ClientContext context;
    return onwards_->Begin(&context, *request, response);
  }
  grpc::Status Finish(grpc::ServerContext*, const v1::PairFinishRequest* request,
                      v1::PairFinishResponse* response) override {
    ++finishes;
    grpc::ClientContext context;
    return onwards_->Finish(&context, *request, response);
  }

 private:
  std::unique_ptr<v1::PairingService::Stub> onwards_;
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
};

class ManInTheMiddleTest : public SecureDaemonTest {
 protected:
  [[nodiscard]] Result<PairedProbe> pair_through(const ManInTheMiddle& proxy, const std::string& code) const {
    PairOptions options;
    options.store = folder_.path("store");
    return pair_with_probe(proxy.uri(), code, options);
  }
  static ProbeKeys keys_in(const std::string& folder) {
    GrpcConfig config;
    config.key_folder = folder;
    return *load_probe_keys(config, "x", std::time(nullptr));
  }
};

TEST_F(ManInTheMiddleTest, GetsNothingAlthoughTheCodeIsRight) {
  PairingMode mode(keys(), "tls", 7420);
  const ManInTheMiddle proxy(keys_in(folder_.path("thief")), mode, read_file(keys() + "/ca.pem"));
  const Result<PairedProbe> paired = pair_through(proxy, mode.code());
  ASSERT_FALSE(paired.ok());
  EXPECT_THAT(paired.status().message(), HasSubstr("somebody stands between"));
  EXPECT_EQ(proxy.finishes, 1);
  EXPECT_FALSE(std::filesystem::exists(keys() + "/clients"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path("store")));
}

TEST_F(ManInTheMiddleTest, WithTheProbesKeyPairingSucceeds) {
  // Control experiment: the test above must not pass because the proxy is broken.
  PairingMode mode(keys(), "tls", 7420);
  const ManInTheMiddle proxy(keys_in(keys()), mode, read_file(keys() + "/ca.pem"));
  const Result<PairedProbe> paired = pair_through(proxy, mode.code());
  ASSERT_TRUE(paired.ok()) << paired.status().message();
  EXPECT_TRUE(std::filesystem::exists(paired->folder + "/token"));
}

TEST_F(ManInTheMiddleTest, AProbeWithAnotherCodeIsRejected) {
  // An impostor that answers in the probe's place with another code.
  PairingMode mode(keys(), "tls", 7420);
  std::string other = mode.code();
  other.back() = other.back() == '0' ? '1' : '0';
  const Result<PairedProbe> paired = pair_with_probe(mode.uri(), other, {.store = folder_.path("store")});
  ASSERT_FALSE(paired.ok());
  EXPECT_FALSE(std::filesystem::exists(folder_.path("store")));
}

/// Answers in the probe's place and records what clients send.
class Impostor final : public v1::ProbeService::Service {
 public:
  Impostor(const std::string& certificate, const std::string& key) {
    grpc::SslServerCredentialsOptions options;
    options.pem_key_cert_pairs.push_back({key, certificate});
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::SslServerCredentials(options), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~Impostor() override { server_->Shutdown(std::chrono::system_clock::now()); }

  [[nodiscard]] std::string uri() const { return "grpcs://127.0.0.1:" + std::to_string(port_); }
  /// The metadata of all calls.
  [[nodiscard]] std::string recorded() const {
    const std::lock_guard lock(mutex_);
    return recorded_;
  }

  grpc::Status Info(grpc::ServerContext* context, const v1::InfoRequest*, v1::InfoResponse*) override {
    const std::lock_guard lock(mutex_);
    for (const auto& [name, value] : context->client_metadata())
      recorded_.append(name.data(), name.size()).append("=").append(value.data(), value.size()).append("\n");
    return {grpc::StatusCode::UNAVAILABLE, "an impostor"};
  }

 private:
  mutable std::mutex mutex_;
  std::string recorded_;
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
};

/// An owner's certificate authority: a root and an intermediate that issues certificates to anyone.
class OwnersAuthority {
 public:
  explicit OwnersAuthority(const TempDir& folder) : folder_(folder) {
    folder_.write("authority.ext", "basicConstraints=critical,CA:TRUE\nkeyUsage=critical,keyCertSign,cRLSign\n");
    openssl({"req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2", "-subj",
             "/CN=root", "-keyout", at("root.key"), "-out", at("root")});
    make_key("intermediate.key");
    issue("intermediate", "intermediate.key", "root", "root.key", "authority.ext");
  }
  /// A certificate chain for `host`: certificate, intermediate, root.
  std::string chain_for(const std::string& host, const std::string& key_file) {
    folder_.write("leaf.ext",
                  "basicConstraints=critical,CA:FALSE\nextendedKeyUsage=serverAuth\nsubjectAltName=DNS:" + host + "\n");
    issue("leaf", key_file, "intermediate", "intermediate.key", "leaf.ext");
    return read_file(at("leaf")) + read_file(at("intermediate")) + read_file(at("root"));
  }
  std::string make_key(const std::string& file) {
    openssl({"ecparam", "-name", "prime256v1", "-genkey", "-noout", "-out", at(file)});
    return read_file(at(file));
  }

 private:
  [[nodiscard]] std::string at(const std::string& file) const { return folder_.path(file); }
  static void openssl(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "/usr/bin/openssl");
    Child child(arguments);
    EXPECT_EQ(child.wait(), (ExitStatus{0, 0})) << child.err();
  }
  void issue(const std::string& file, const std::string& key, const std::string& issuer, const std::string& issuer_key,
             const std::string& extensions) {
    openssl({"req", "-new", "-key", at(key), "-subj", "/CN=" + file, "-out", at("request")});
    openssl({"x509", "-req", "-in", at("request"), "-CA", at(issuer), "-CAkey", at(issuer_key), "-CAcreateserial",
             "-days", "2", "-extfile", at(extensions), "-out", at(file)});
  }

  const TempDir& folder_;
};

class PinnedChainTest : public SecureDaemonTest {
 protected:
  PinnedChainTest()
      : key_(authority_.make_key("own_key.pem")),
        chain_(authority_.chain_for("attic.example", "own_key.pem")),
        other_key_(authority_.make_key("other_key.pem")),
        other_chain_(authority_.chain_for("shop.example", "other_key.pem")) {
    show(chain_);
  }
  /// Makes the probe present this chain from its next start on.
  void show(const std::string& chain) const { folder_.write("own.pem", chain); }
  [[nodiscard]] DaemonOptions showing() const {
    const std::string config = folder_.write(
        "probe.textproto", "camera { uri: \"sim:" + folder_.path("room.exr") +
                               "\" }\ngrpc { security: LINK_SECURITY_TLS key_folder: \"keys\" certificate: \"own.pem\" "
                               "key: \"own_key.pem\" }\n");
    return {.more = {"--config", config}};
  }
  /// Pairs with the probe; returns the folder of credentials.
  std::string paired() {
    PairingMode mode(showing().more, 7420);
    return pair(mode);
  }
  /// Connects with a short timeout, because a rejected connection ends only with the timeout.
  static Result<Probe> try_connect(const Impostor& impostor, const std::string& folder) {
    ProbeCredentials c;
    c.folder = folder;
    return connect(impostor.uri(), c);
  }
  static void expect_refused(const std::string& folder, const Impostor& impostor) {
    const Result<Probe> probe = try_connect(impostor, folder);
    ASSERT_FALSE(probe.ok());
    EXPECT_THAT(probe.status().message(), AllOf(HasSubstr("TLS handshake failed"), HasSubstr("pair with it again")));
    EXPECT_EQ(impostor.recorded(), "") << "no call, and so no token, may arrive";
  }
  static ::testing::AssertionResult receives_light(const std::string& uri, const std::string& folder) {
    const Result<Probe> probe = connect(uri, folder);
    return probe.ok() ? gets_light(*probe) : ::testing::AssertionFailure() << probe.status().message();
  }

  OwnersAuthority authority_{folder_};
  const std::string key_, chain_, other_key_, other_chain_;
};

TEST_F(PinnedChainTest, AnotherCertificateOfTheSameIntermediateIsRejectedBeforeTheTokenIsSent) {
  const std::string folder = paired();
  const std::string token = read_file(folder + "/token");
  ASSERT_GE(token.size(), kTokenLength);
  expect_refused(folder, Impostor(other_chain_, other_key_));
  // Control experiment: an impostor with the pinned key receives the token, so the check above can detect it.
  const Impostor impostor(chain_, key_);
  EXPECT_FALSE(try_connect(impostor, folder).ok());
  EXPECT_THAT(impostor.recorded(), HasSubstr(token.substr(0, kTokenLength)));
  EXPECT_TRUE(receives_light(Daemon(showing()).uri(), folder));
}

TEST_F(PinnedChainTest, OfAStoredChainOnlyTheFirstCertificateIsPinned) {
  const std::string folder = paired();
  std::ofstream(folder + "/probe_ca.pem") << chain_;
  std::filesystem::remove(folder + "/host");
  expect_refused(folder, Impostor(other_chain_, other_key_));
  EXPECT_TRUE(receives_light(Daemon(showing()).uri(), folder));
}

TEST_F(PinnedChainTest, ARenewedCertificateWithTheSameKeyIsAccepted) {
  const std::string folder = paired();
  show(authority_.chain_for("attic.example", "own_key.pem"));
  EXPECT_TRUE(receives_light(Daemon(showing()).uri(), folder));
  const std::string key = authority_.make_key("own_key.pem");
  expect_refused(folder, Impostor(authority_.chain_for("attic.example", "own_key.pem"), key));
}

TEST_F(PinnedChainTest, APinnedAuthorityIsOnlyTrustedForTheProbesName) {
  ProbeCredentials c;
  c.pinned = read_file(folder_.path("intermediate"));
  c.token = std::string(kTokenLength, 'x');
  const Impostor other(other_chain_, other_key_);
  const Result<Probe> refused = connect(other.uri(), c);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.status().message(),
              AllOf(HasSubstr("is not valid for probe.lightwell.internal"), HasSubstr("`ca`")));
  EXPECT_EQ(other.recorded(), "");
  const Impostor named(authority_.chain_for(kProbeHostName, "other_key.pem"), other_key_);
  EXPECT_FALSE(connect(named.uri(), c).ok());
  EXPECT_THAT(named.recorded(), HasSubstr(c.token)) << "the other impostor was rejected only for its name";
}

}  // namespace
}  // namespace lightwell::test
