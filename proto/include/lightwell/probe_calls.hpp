// Requests and responses of ProbeService as bytes, for a link with its own RPC.
//   answer_probe_call        probe: executes a request with its Commands
//   encode_..., decode_...   host: encodes requests, decodes responses
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <lightwell/config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

namespace lightwell {

enum class ProbeCall : std::uint8_t { info, set_config, report_lux, get_config };

/// The response in binary form. data_loss if `request` is not a request of this call; otherwise the error of
/// `commands`, or why they were not called. Calls `commands` on this thread.
[[nodiscard]] Result<std::string> answer_probe_call(ProbeCall call, std::string_view request, Commands& commands);

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
