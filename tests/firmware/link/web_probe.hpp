// Fixtures: a web link on the loopback with fake commands, in plain text and over TLS with its own keys.
#pragma once

#include <ctime>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/link_message.hpp>
#include <lightwell/secrets.hpp>

#include "firmware/link/link_messages.hpp"
#include "firmware/link/raw_web_client.hpp"
#include "link/access/probe_keys.hpp"
#include "link/web/web_link.hpp"
#include "support/fake_commands.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {

[[nodiscard]] inline std::string as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
[[nodiscard]] inline std::string info_request(std::uint32_t id) {
  std::vector<std::byte> out;
  encode_info_request(id, out);
  return as_text(out);
}
/// A LinkRequest `authenticate`, written byte by byte: id (field 1, fixed32), authenticate (6) with token (1).
[[nodiscard]] inline std::string authenticate_request(const std::string& token, char id = 1) {
  std::string out{'\x0d', id, 0, 0, 0};
  out += {'\x32', static_cast<char>(token.size() + 2), '\x0a', static_cast<char>(token.size())};
  return out + token;
}
/// The response in a message; an error if it is none.
[[nodiscard]] inline Result<LinkResponse> response_in(const std::optional<std::string>& message) {
  if (!message) return Status(StatusCode::unavailable, "no message arrived");
  return decode_link_response(std::as_bytes(std::span(*message)));
}

/// Files as the dashboard has them; the large one needs several writes.
[[nodiscard]] inline std::span<const StaticFile> test_files() {
  static const std::string page = "<!doctype html><title>probe</title>", script(300'000, 'x');
  static const StaticFile files[] = {{"/index.html", std::as_bytes(std::span(page))},
                                     {"/parts/large.js", std::as_bytes(std::span(script))},
                                     {"/secret.key", std::as_bytes(std::span(page))}};
  return files;
}

class WebLinkTest : public ::testing::Test {
 protected:
  void start(WebConfig config = {}) {
    config.listen_address = "127.0.0.1:0";
    link_ = make_web_link(config, {}, "attic", commands_, test_files());
    const Status started = link_->start();
    ASSERT_TRUE(started.ok()) << started.message();
  }
  void SetUp() override { start(); }

  [[nodiscard]] ::testing::AssertionResult clients_become(std::uint32_t count) const {
    return becomes_true("the link has " + std::to_string(count) + " clients",
                        [&] { return link_->counters().clients == count; });
  }

  FakeCommands commands_;  // Before the link, which uses it.
  std::unique_ptr<Link> link_;
};

/// A client's key pair and the credentials it received at pairing.
struct WebPairedClient {
  KeyPair key;
  ClientCredentials credentials;
};

class GuardedWebTest : public ::testing::Test {
 protected:
  void listen(LinkSecurity security, WebConfig config = {}) {
    config.listen_address = "127.0.0.1:0";
    config.security = keys_config_.security = security;
    keys_config_.key_folder = folder_.path("keys");
    link_ = make_web_link(config, keys_config_, "attic", commands_, test_files());
    const Status started = link_->start();
    ASSERT_TRUE(started.ok()) << started.message();
  }
  [[nodiscard]] ProbeKeys keys() const {
    const Result<ProbeKeys> keys = load_probe_keys(keys_config_, "attic", std::time(nullptr));
    EXPECT_TRUE(keys.ok()) << keys.status().message();
    return keys.ok() ? *keys : ProbeKeys();
  }
  /// Registers a client for `days`; a negative number makes it expired.
  [[nodiscard]] WebPairedClient pair_client(int days = 1) const {
    const Result<KeyPair> key = KeyPair::make();
    const std::int64_t now = std::time(nullptr);
    const Result<ClientCredentials> credentials = register_client(
        keys(), "a client", key->public_pem, days < 0 ? 1 : days, now + (days < 0 ? days - 1 : 0) * 86'400);
    EXPECT_TRUE(credentials.ok()) << credentials.status().message();
    return {*key, *credentials};
  }
  [[nodiscard]] RawTls trusting() const { return {keys().trust}; }
  [[nodiscard]] RawTls showing(const WebPairedClient& client) const {
    return {keys().trust, client.credentials.certificate, client.key.private_pem};
  }
  [[nodiscard]] static std::string bearer(const std::string& token) {
    return "Authorization: Bearer " + token + "\r\n";
  }

  TempDir folder_;
  GrpcConfig keys_config_;
  FakeCommands commands_;
  std::unique_ptr<Link> link_;
};

}  // namespace lightwell::test
