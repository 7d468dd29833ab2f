// Checks of the listen address: its form, and whether plain text is allowed on it.
#pragma once

#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// Whether `listen` is HOST:PORT with a port of 0 to 65535. gRPC itself uses port 443 if none is given, and 34463 for
/// 99999.
[[nodiscard]] bool is_host_and_port(std::string_view listen);
/// Whether the address is reachable from this machine only.
[[nodiscard]] bool is_loopback(std::string_view listen);
/// failed_precondition, with the remedies: `config` would listen in plain text on a non-loopback address without an
/// explicit choice of plain text.
[[nodiscard]] Status check_bind_policy(const GrpcConfig& config);

}  // namespace lightwell
