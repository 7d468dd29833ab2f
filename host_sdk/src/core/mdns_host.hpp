// Machines whose names end in .local: multicast DNS (RFC 6762), which gRPC's own resolver does not ask.
#pragma once

#include <atomic>
#include <optional>
#include <string>

namespace lightwell::core {

/// Whether the host of "host:port" is a name of multicast DNS.
[[nodiscard]] bool is_mdns_name(const std::string& host_port);

/// "host:port" with the address that the machine has now, IPv4 where it has both; ask again for the next connection.
/// Nothing where none answers within a second, where this machine cannot ask (no avahi-daemon, built without Avahi), or
/// once `*stopping`, if there is one.
[[nodiscard]] std::optional<std::string> mdns_address(const std::string& host_port, const std::atomic<bool>* stopping);

}  // namespace lightwell::core
