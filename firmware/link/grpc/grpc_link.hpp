// The gRPC link: ProbeService with the health and reflection services, in plain text, or over TLS with authorized
// clients. Each client has one slot for the newest descriptor.
#pragma once

#include <ctime>
#include <memory>
#include <string_view>

#include <lightwell/commands.hpp>
#include <lightwell/config.hpp>

#include "link/access/probe_keys.hpp"
#include "link/link.hpp"

namespace lightwell {

/// Paths in `config` are opened as given. start() fails as GrpcConfig::check_bind_policy() does, and creates missing
/// keys. `commands` must outlive the link and is called from gRPC's threads. `clock` determines when the probe's
/// certificate is renewed.
[[nodiscard]] std::unique_ptr<Link> make_grpc_link(
    const GrpcConfig& config, std::string_view probe_name, Commands& commands,
    WallClock clock = [] { return std::time(nullptr); });

}  // namespace lightwell
