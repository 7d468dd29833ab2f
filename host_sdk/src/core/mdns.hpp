// Resolution of host names in .local by multicast DNS (RFC 6762), which gRPC's resolver does not support.
#pragma once

#include <atomic>
#include <optional>
#include <string>

namespace lightwell::core {

/// Whether the host of "host:port" is a name in .local.
[[nodiscard]] bool is_mdns_name(const std::string& host_port);

/// "host:port" with the host's current address, IPv4 if it has both; resolve again for each connection. No value if
/// there is no answer within a second, if multicast DNS is not available (no avahi-daemon, built without Avahi), or
/// once `*stopping` is set (may be null).
[[nodiscard]] std::optional<std::string> mdns_address(const std::string& host_port, const std::atomic<bool>* stopping);

}  // namespace lightwell::core
