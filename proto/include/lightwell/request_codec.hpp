// A host's requests to ProbeService and the probe's responses as bytes, for a link with its own RPC.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A SetConfigRequest. The request of get_config is empty.
[[nodiscard]] std::string encode_set_config_request(const EstimatorUpdate& update);
/// normal: probe frame, need not be normalised.
[[nodiscard]] std::string encode_report_lux_request(double lux, Vec3d normal);

/// data_loss for bytes that are not a GetConfigResponse, or a configuration that this version does not know.
[[nodiscard]] Result<EstimatorState> decode_get_config_response(std::span<const std::byte> response);
/// The configuration after the change; no value from older firmware, which ignores EstimatorUpdate::panorama and
/// marker.
[[nodiscard]] Result<std::optional<EstimatorState>> decode_set_config_response(std::span<const std::byte> response);
/// The factor that was applied to radiance. data_loss for bytes that are not a ReportLuxResponse.
[[nodiscard]] Result<double> decode_report_lux_response(std::span<const std::byte> response);

}  // namespace lightwell
