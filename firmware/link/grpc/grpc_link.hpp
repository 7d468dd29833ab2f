// The gRPC link: ProbeService with health and reflection, every client with its own newest-wins place; plain, or over
// TLS with clients that the probe knows.
#pragma once

#include <ctime>
#include <memory>
#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/status.hpp>

#include "link/access/probe_keys.hpp"
#include "link/link.hpp"

namespace lightwell {

/// Files named in `config` are as they are to be opened. start() refuses what check_bind_policy() does, and makes keys
/// where there are none yet. `commands` must outlive the link and is called from gRPC's threads. `clock` says when the
/// probe's certificate is due to be renewed.
[[nodiscard]] std::unique_ptr<Link> make_grpc_link(
    const GrpcConfig& config, std::string_view probe_name, Commands& commands,
    WallClock clock = [] { return std::time(nullptr); });

}  // namespace lightwell
