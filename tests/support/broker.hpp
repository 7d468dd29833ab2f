// Runs a mosquitto broker for a test, on a free port of the loopback address.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "support/certificates.hpp"
#include "support/child.hpp"

namespace lightwell::test {

struct BrokerOptions {
  std::optional<KeyPair> tls{};
  /// If set, clients must present a certificate of this authority.
  std::string client_ca{};
  /// Names and passwords; if there are any, anonymous clients are rejected.
  std::map<std::string, std::string> users{};
  /// Further lines of mosquitto.conf.
  std::string more{};
};

class Broker {
 public:
  explicit Broker(BrokerOptions options = {});

  /// Starts again on the same port; retained messages are lost.
  void start();
  void stop();
  [[nodiscard]] Child& process() { return *child_; }

  [[nodiscard]] int port() const { return port_; }
  /// "mqtt://127.0.0.1:41234/venue/attic"
  [[nodiscard]] std::string uri(const std::string& base) const;

 private:
  const BrokerOptions options_;
  TempDir folder_;
  int port_ = 0;
  std::optional<Child> child_;
};

/// A TCP port of 127.0.0.1 on which no process listens.
[[nodiscard]] int free_port();

}  // namespace lightwell::test
