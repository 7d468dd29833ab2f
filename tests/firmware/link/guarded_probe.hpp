// Fixture: a gRPC link over TLS on the loopback with its own keys, and paired clients.
#pragma once

#include <ctime>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include <lightwell/secrets.hpp>

#include "firmware/link/probe_server.hpp"
#include "link/access/client_list.hpp"
#include "link/access/probe_keys.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {

inline constexpr const char* kInfo = "/lightwell.v1.ProbeService/Info";

/// A client's key pair and the credentials it received at pairing.
struct PairedClient {
  KeyPair key;
  ClientCredentials credentials;
};

class GuardedProbeTest : public ::testing::Test {
 protected:
  /// Starts the link. Call it once.
  void listen(LinkSecurity security, const std::string& address = "127.0.0.1:0", const WallClock& clock = now) {
    config_.listen_address = address;
    config_.security = security;
    config_.key_folder = folder_.path("keys");
    link_ = make_grpc_link(config_, "attic", commands_, clock);
    const Status started = link_->start();
    ASSERT_TRUE(started.ok()) << started.message();
  }
  [[nodiscard]] ProbeKeys keys() const {
    const Result<ProbeKeys> keys = load_probe_keys(config_, "attic", now());
    EXPECT_TRUE(keys.ok()) << keys.status().message();
    return keys.ok() ? *keys : ProbeKeys();
  }
  /// Registers a client for `days`; a negative number makes it expired.
  [[nodiscard]] PairedClient pair_client(int days = 1) const {
    const Result<KeyPair> key = KeyPair::make();
    EXPECT_TRUE(key.ok());
    const Result<ClientCredentials> credentials = register_client(
        keys(), "a client", key->public_pem, days < 0 ? 1 : days, days < 0 ? now() + (days - 1) * 86'400 : now());
    EXPECT_TRUE(credentials.ok()) << credentials.status().message();
    return {*key, *credentials};
  }
  /// A channel that trusts the probe, with an optional client certificate.
  [[nodiscard]] std::shared_ptr<grpc::Channel> channel(const std::string& certificate = {},
                                                       const std::string& key = {}) const {
    return connect(*link_, grpc::SslCredentials({keys().trust, key, certificate}));
  }
  [[nodiscard]] std::shared_ptr<grpc::Channel> channel_of(const PairedClient& client) const {
    return channel(client.credentials.certificate, client.key.private_pem);
  }
  [[nodiscard]] static std::int64_t now() { return std::time(nullptr); }

  TempDir folder_;
  GrpcConfig config_;
  FakeCommands commands_;  // Before the link, which uses it.
  std::unique_ptr<Link> link_;
};

}  // namespace lightwell::test
