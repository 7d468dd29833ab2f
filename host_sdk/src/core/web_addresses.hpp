// Numeric addresses of a host.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::core {

/// "host:port" or "[v6]:port" in its parts; the host without brackets.
struct HostAndPort {
  std::string host;
  int port = 0;
};
[[nodiscard]] HostAndPort split_host_port(const std::string& host_port);

/// Numeric addresses of the host of "host:port", in the order in which they should be tried. A name in .local is
/// resolved by multicast DNS (mdns_address()), any other by the system's resolver, which may take many seconds; the
/// function returns early once `stopping` is set. unavailable: there is none; the message says what to do.
[[nodiscard]] Result<std::vector<std::string>> addresses_of(const std::string& host_port,
                                                            const std::atomic<bool>& stopping);

}  // namespace lightwell::core
