// ProbeService's calls as bytes of their messages: for a link that has calls of its own.
//   answer_probe_call    the probe answers, by its Commands
//   encode_..., decode_...   the host asks, and reads the answer
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

/// The response in binary form. data_loss where `request` is not the call's request; otherwise what Commands said, or
/// why they were not asked. Calls `commands` on this thread.
[[nodiscard]] Result<std::string> answer_probe_call(ProbeCall call, std::string_view request, Commands& commands);

/// A SetConfigRequest. The request of get_config is empty.
[[nodiscard]] std::string encode_set_config_request(const EstimatorUpdate& update);
/// normal: probe frame, need not be normalised.
[[nodiscard]] std::string encode_report_lux_request(double lux, Vec3d normal);

/// data_loss for bytes that are no GetConfigResponse, and where the configuration is none that this version knows.
[[nodiscard]] Result<EstimatorState> decode_get_config_response(std::span<const std::byte> response);
/// What holds now; nothing of a probe whose firmware passed over what EstimatorUpdate has in `panorama` and `marker`.
[[nodiscard]] Result<std::optional<EstimatorState>> decode_set_config_response(std::span<const std::byte> response);
/// The factor that was applied. data_loss for bytes that are no ReportLuxResponse.
[[nodiscard]] Result<double> decode_report_lux_response(std::span<const std::byte> response);

}  // namespace lightwell
