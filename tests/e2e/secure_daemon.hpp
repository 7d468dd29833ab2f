// A daemon with TLS, lightwelld --pair, and the credentials of a client.
#pragma once

#include <string>
#include <vector>

#include "e2e/daemon.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {

/// The port of an address: the number after the last colon.
[[nodiscard]] int port_of(const std::string& address);

/// Runs `lightwelld --pair`; the constructor waits until it shows its code.
class PairingMode {
 public:
  PairingMode(const std::string& keys, const std::string& security, int link_port)
      : PairingMode({"--security", security, "--keys", keys}, link_port) {}
  /// `options`: those of the daemon for which it pairs clients.
  PairingMode(std::vector<std::string> options, int link_port);

  [[nodiscard]] const std::string& uri() const { return uri_; }
  [[nodiscard]] const std::string& code() const { return code_; }
  [[nodiscard]] Child& process() { return child_; }

 private:
  Child child_;
  std::string uri_, code_;
};

class SecureDaemonTest : public ::testing::Test {
 protected:
  SecureDaemonTest() { write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x()); }

  [[nodiscard]] DaemonOptions options(const std::string& security, const std::string& listen = "127.0.0.1:0") const {
    return {.camera = "sim:" + folder_.path("room.exr"),
            .listen = listen,
            .more = {"--security", security, "--keys", keys()}};
  }
  [[nodiscard]] std::string keys() const { return folder_.path("keys"); }
  [[nodiscard]] ChildOptions environment() const {
    return {.environment = {"XDG_CONFIG_HOME=" + folder_.path("config")}};
  }
  /// The command line of the tool; run it with environment() for a separate configuration folder.
  [[nodiscard]] std::vector<std::string> tool(std::vector<std::string> arguments) const {
    return tool_command(std::move(arguments));
  }
  /// Pairs with the tool, through the proxy at `through_port` if it is not 0; returns the folder of credentials.
  std::string pair(PairingMode& mode, int through_port = 0);
  /// Runs a pairing mode for the daemon at `uri` and pairs with it.
  std::string pair(const std::string& uri, const std::string& security = "tls") {
    PairingMode mode(keys(), security, port_of(uri));
    return pair(mode);
  }
  [[nodiscard]] static Result<Probe> connect(const std::string& uri, const ProbeCredentials& credentials,
                                             Duration timeout = Duration{2'000'000'000}) {
    ProbeOptions o;
    o.max_age = kAnyAge;
    o.connect_timeout = timeout;
    o.credentials = credentials;
    return Probe::connect(uri, std::move(o));
  }
  [[nodiscard]] static Result<Probe> connect(const std::string& uri, const std::string& folder) {
    ProbeCredentials c;
    c.folder = folder;
    return connect(uri, c, Duration{kTestTimeout.count() * 1'000'000});
  }
  [[nodiscard]] static ::testing::AssertionResult gets_light(const Probe& probe) {
    const std::uint64_t before = probe.stats().received;
    return becomes_true("a descriptor arrives", [&] { return probe.stats().received > before; });
  }

  TempDir folder_;
};

}  // namespace lightwell::test
