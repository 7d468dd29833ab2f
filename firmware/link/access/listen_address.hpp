// Addresses on which the probe's network links listen.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell {

/// Whether `listen` is HOST:PORT with a port of 0 to 65535. gRPC itself uses port 443 if none is given, and 34463 for
/// 99999.
[[nodiscard]] bool is_host_and_port(std::string_view listen);
/// The error for an address on which the server cannot listen. `options`: the options that set it.
[[nodiscard]] Status listen_error(const std::string& listen, const std::string& options);

/// A numeric address and a port, for servers that resolve no names.
struct ListenTarget {
  std::string address;  ///< Empty: all addresses of this machine.
  bool ipv6 = false;
  int port = 0;
};
/// Of HOST:PORT (is_host_and_port()); no value if the host cannot be resolved. May wait for the name resolver.
[[nodiscard]] std::optional<ListenTarget> resolve_listen_address(const std::string& listen);

}  // namespace lightwell
