// `lightwelld --pair`: pairs one client by a code.
#pragma once

#include <string>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// Opens a pairing window, prints its address and code to stdout, and waits until it closes or a signal comes.
/// `listen`: HOST:PORT; empty: the host of the gRPC link with port 7421. failed_precondition: the configuration has no
/// encryption; unavailable: no client was paired.
[[nodiscard]] Status run_pairing(const Config& config, const std::string& listen);

}  // namespace lightwell
