// Someone stands between at a pairing: ends the encryption on both sides, reads all and passes it on.
#include <filesystem>

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <lightwell/pair.hpp>
#include <lightwell/secrets.hpp>

#include "e2e/secure_daemon.hpp"
#include "lightwell/v1/pairing.grpc.pb.h"
#include "link/access/certificate.hpp"
#include "link/access/probe_keys.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

/// Hands every message on as it is.
class OneBetween final : public v1::PairingService::Service {
 public:
  OneBetween(const ProbeKeys& shown, const PairingMode& probe, const std::string& probes_authority) {
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
  ~OneBetween() override { server_->Shutdown(std::chrono::system_clock::now()); }

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

class BetweenTest : public SecureDaemonTest {
 protected:
  [[nodiscard]] Result<PairedProbe> pair_through(const OneBetween& between, const std::string& code) const {
    PairOptions options;
    options.store = folder_.path("store");
    return pair_with_probe(between.uri(), code, options);
  }
  static ProbeKeys keys_in(const std::string& folder) {
    GrpcConfig config;
    config.keys = folder;
    return *load_probe_keys(config, "x", std::time(nullptr));
  }
};

TEST_F(BetweenTest, WhoStandsBetweenGetsNothingEvenWhereTheCodeIsRight) {
  PairingMode mode(keys(), "tls", 7420);
  const OneBetween between(keys_in(folder_.path("thief")), mode, file_text(keys() + "/ca.pem"));
  const Result<PairedProbe> paired = pair_through(between, mode.code());
  ASSERT_FALSE(paired.ok());
  EXPECT_THAT(paired.status().message(), HasSubstr("somebody stands between"));
  EXPECT_EQ(between.finishes, 1);
  EXPECT_FALSE(std::filesystem::exists(keys() + "/clients"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path("store")));
}

TEST_F(BetweenTest, TheSameOneWithTheProbesOwnKeyWouldGetThrough) {
  // So that the test above cannot pass because the one between is broken.
  PairingMode mode(keys(), "tls", 7420);
  const OneBetween between(keys_in(keys()), mode, file_text(keys() + "/ca.pem"));
  const Result<PairedProbe> paired = pair_through(between, mode.code());
  ASSERT_TRUE(paired.ok()) << paired.status().message();
  EXPECT_TRUE(std::filesystem::exists(paired->folder + "/token"));
}

TEST_F(BetweenTest, AProbeThatDoesNotKnowTheCodeIsNotBelieved) {
  // A thief that answers in the probe's place, with a code of its own.
  PairingMode mode(keys(), "tls", 7420);
  std::string other = mode.code();
  other.back() = other.back() == '0' ? '1' : '0';
  const Result<PairedProbe> paired = pair_with_probe(mode.uri(), other, {.store = folder_.path("store")});
  ASSERT_FALSE(paired.ok());
  EXPECT_FALSE(std::filesystem::exists(folder_.path("store")));
}

}  // namespace
}  // namespace lightwell::test
