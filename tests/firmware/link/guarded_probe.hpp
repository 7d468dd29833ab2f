// A link over TLS on the loopback, with keys of its own, and the clients that it knows.
#pragma once

#include <ctime>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include <lightwell/secrets.hpp>

#include "firmware/link/probe_server.hpp"
#include "link/access/certificate.hpp"
#include "link/access/client_list.hpp"
#include "link/access/probe_keys.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {

inline constexpr const char* kInfo = "/lightwell.v1.ProbeService/Info";

/// A client's key and what the probe gave it.
struct KnownClient {
  KeyPair key;
  ClientCredentials given;
};

class GuardedProbeTest : public ::testing::Test {
 protected:
  /// Starts the link. Call it once.
  void listen(LinkSecurity security, const std::string& address = "127.0.0.1:0", const WallClock& clock = now) {
    config_.listen = address;
    config_.security = security;
    config_.keys = folder_.path("keys");
    link_ = make_grpc_link(config_, "attic", commands_, clock);
    const Status started = link_->start();
    ASSERT_TRUE(started.ok()) << started.message();
  }
  [[nodiscard]] ProbeKeys keys() const {
    const Result<ProbeKeys> keys = load_probe_keys(config_, "attic", now());
    EXPECT_TRUE(keys.ok()) << keys.status().message();
    return keys.ok() ? *keys : ProbeKeys();
  }
  /// `days` may be negative: one whose time is over.
  [[nodiscard]] KnownClient known_client(int days = 1) const {
    const Result<KeyPair> key = KeyPair::make();
    EXPECT_TRUE(key.ok());
    const Result<ClientCredentials> given = register_client(keys(), "a client", key->public_pem, days < 0 ? 1 : days,
                                                 days < 0 ? now() + (days - 1) * 86'400 : now());
    EXPECT_TRUE(given.ok()) << given.status().message();
    return {*key, *given};
  }
  /// Trusts the probe, and shows a certificate where there is one.
  [[nodiscard]] std::shared_ptr<grpc::Channel> channel(const std::string& certificate = {},
                                                       const std::string& key = {}) const {
    return connect(*link_, grpc::SslCredentials({keys().trust, key, certificate}));
  }
  [[nodiscard]] std::shared_ptr<grpc::Channel> channel_of(const KnownClient& client) const {
    return channel(client.given.certificate, client.key.private_pem);
  }
  [[nodiscard]] static std::int64_t now() { return std::time(nullptr); }

  TempDir folder_;
  GrpcConfig config_;
  FakeCommands commands_;  // before the link, which calls it
  std::unique_ptr<Link> link_;
};

}  // namespace lightwell::test
