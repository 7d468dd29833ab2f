// A mosquitto of the test's own, on a free port of the loopback.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "support/certificates.hpp"
#include "support/child.hpp"

namespace lightwell::test {

struct BrokerOptions {
  std::optional<KeyPair> tls{};
  /// Clients must show a certificate of this authority.
  std::string client_ca{};
  /// Names and passwords; where there are any, nobody comes in without.
  std::map<std::string, std::string> users{};
  /// Lines of mosquitto.conf.
  std::string more{};
};

class Broker {
 public:
  explicit Broker(BrokerOptions options = {});

  /// Comes back on the same port, having forgotten what was retained.
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

/// A TCP port of 127.0.0.1 that nobody listens on.
[[nodiscard]] int free_port();

}  // namespace lightwell::test
