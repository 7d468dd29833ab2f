// `lightwelld --pair`: one client is made known to the probe, by a code.
#pragma once

#include <string>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// Opens a pairing window, prints its address and code to stdout, and waits until it closes or a signal comes.
/// `listen`: HOST:PORT; empty: the host of the link with port 7421. failed_precondition where the configuration has no
/// encryption, unavailable where nobody was paired.
[[nodiscard]] Status run_pairing(const Config& config, const std::string& listen);

}  // namespace lightwell
