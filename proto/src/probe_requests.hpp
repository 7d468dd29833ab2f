// Execution of requests by a probe's Commands, and encoding of requests by a host; shared by all links.
#pragma once

#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

#include "lightwell/v1/probe_service.pb.h"

namespace lightwell {

/// The response to Info: status and clock.
void answer_info(const StatusSnapshot& status, v1::InfoResponse& response);
/// The estimator's part of the configuration only.
void answer_get_config(const Commands& commands, v1::GetConfigResponse& response);
/// failed_precondition, naming them, if fields are set that a running probe cannot change.
[[nodiscard]] Status answer_set_config(const v1::Config& config, Commands& commands, v1::SetConfigResponse& response);
[[nodiscard]] Result<double> answer_report_lux(const v1::ReportLuxRequest& request, Commands& commands);

void fill_set_config(const EstimatorUpdate& update, v1::SetConfigRequest& request);
void fill_report_lux(double lux, Vec3d normal, v1::ReportLuxRequest& request);
/// data_loss if this version does not know the configuration.
[[nodiscard]] Result<EstimatorState> state_of(const v1::GetConfigResponse& response);

}  // namespace lightwell
