// Conversion of a probe's status to and from the generated message, shared by all links.
#pragma once

#include <lightwell/status.hpp>

#include "lightwell/v1/probe_service.pb.h"

namespace lightwell {

/// All fields except the clock.
void fill_status(const StatusSnapshot& status, v1::InfoResponse& m);
[[nodiscard]] StatusSnapshot status_of(const v1::InfoResponse& m);

}  // namespace lightwell
