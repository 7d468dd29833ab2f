// What a probe does with each request that asks its Commands, whichever link brought it, and how a host words it.
#pragma once

#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

#include "lightwell/v1/probe_service.pb.h"

namespace lightwell {

/// Status and clock.
void answer_info(const StatusSnapshot& status, v1::InfoResponse& response);
/// The estimator's part of the configuration, and nothing else of it.
void answer_get_config(const Commands& commands, v1::GetConfigResponse& response);
/// failed_precondition, naming them, where fields are set that a running probe cannot change.
[[nodiscard]] Status answer_set_config(const v1::Config& config, Commands& commands, v1::SetConfigResponse& response);
[[nodiscard]] Result<double> answer_report_lux(const v1::ReportLuxRequest& request, Commands& commands);

void fill_set_config(const EstimatorUpdate& update, v1::SetConfigRequest& request);
void fill_report_lux(double lux, Vec3d normal, v1::ReportLuxRequest& request);
/// data_loss where it is none that this version knows.
[[nodiscard]] Result<EstimatorState> state_of(const v1::GetConfigResponse& response);

}  // namespace lightwell
