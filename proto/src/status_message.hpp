// A probe's status in the generated message: the one place that names its fields, whichever link it goes over.
#pragma once

#include <lightwell/status.hpp>

#include "lightwell/v1/probe_service.pb.h"

namespace lightwell {

/// All but the clock.
void fill_status(const StatusSnapshot& status, v1::InfoResponse& m);
[[nodiscard]] StatusSnapshot status_of(const v1::InfoResponse& m);

}  // namespace lightwell
