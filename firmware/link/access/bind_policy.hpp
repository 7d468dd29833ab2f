// Which addresses a probe may listen on, and in which way.
#pragma once

#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// HOST:PORT with a port of 0 to 65535. gRPC itself would take port 443 where none is named, and 34463 for 99999.
[[nodiscard]] bool is_host_and_port(std::string_view listen);
/// Whether the address is reached from this machine alone.
[[nodiscard]] bool is_loopback(std::string_view listen);
/// failed_precondition, with the remedies, where `config` would tell a network in plain text what nobody said it may
/// know.
[[nodiscard]] Status check_bind_policy(const GrpcConfig& config);

}  // namespace lightwell
