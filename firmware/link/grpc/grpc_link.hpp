// The gRPC link: ProbeService with health and reflection, every client with its own newest-wins place.
#pragma once

#include <lightwell/status.hpp>
#include <memory>
#include <string>

#include "link/link.hpp"

namespace lightwell {

/// `listen`: "host:port"; port 0 takes any. `commands` must outlive the link and is called from gRPC's threads.
[[nodiscard]] std::unique_ptr<Link> make_grpc_link(const std::string& listen, Commands& commands);

}  // namespace lightwell
