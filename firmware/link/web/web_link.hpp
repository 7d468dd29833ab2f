// The web link: descriptors, planes and requests by WebSocket, the dashboard's files and metrics by HTTP, on one port.
#pragma once

#include <ctime>
#include <memory>
#include <span>
#include <string_view>

#include <lightwell/commands.hpp>
#include <lightwell/config.hpp>

#include "link/access/probe_keys.hpp"
#include "link/link.hpp"
#include "link/web/static_file.hpp"

namespace lightwell {

/// Paths in `keys` (Config::web_keys()) are opened as given. start() fails as WebConfig::check_bind_policy() does, and
/// creates missing keys. `commands` must outlive the link and is called from its thread. `files` are served unless
/// config.dashboard is off. `clock` determines when the probe's certificate is renewed.
[[nodiscard]] std::unique_ptr<Link> make_web_link(
    const WebConfig& config, const GrpcConfig& keys, std::string_view probe_name, Commands& commands,
    std::span<const StaticFile> files, WallClock clock = [] { return std::time(nullptr); });

}  // namespace lightwell
