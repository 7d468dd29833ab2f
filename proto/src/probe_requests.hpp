// What a probe does with each request that asks its Commands, whichever link brought it.
#pragma once

#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

#include "lightwell/v1/probe_service.pb.h"

namespace lightwell {

/// Status and clock.
void answer_info(const StatusSnapshot& status, v1::InfoResponse& response);
/// failed_precondition, naming them, where fields are set that a running probe cannot change.
[[nodiscard]] Status answer_set_config(const v1::Config& config, Commands& commands, v1::SetConfigResponse& response);
[[nodiscard]] Result<double> answer_report_lux(const v1::ReportLuxRequest& request, Commands& commands);

}  // namespace lightwell
