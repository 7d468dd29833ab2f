// Conversion of a host's requests to ProbeService, and of the probe's configuration in responses; shared by all links.
#pragma once

#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "lightwell/v1/probe_service.pb.h"

namespace lightwell {

void fill_set_config(const EstimatorUpdate& update, v1::SetConfigRequest& request);
void fill_report_lux(double lux, Vec3d normal, v1::ReportLuxRequest& request);
/// data_loss if this version does not know the configuration.
[[nodiscard]] Result<EstimatorState> state_of(const v1::GetConfigResponse& response);

}  // namespace lightwell
