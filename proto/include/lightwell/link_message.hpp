// A host's requests and the probe's responses as bytes: messages of link_message.proto on a link without its own RPC
// (USB), and of probe_service.proto on a link with one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

namespace lightwell {

/// A LinkRequest, written into `out`, whose memory is reused.
void encode_info_request(std::uint32_t id, std::vector<std::byte>& out);
void encode_get_config_request(std::uint32_t id, std::vector<std::byte>& out);
void encode_set_config_request(std::uint32_t id, const EstimatorUpdate& update, std::vector<std::byte>& out);
/// normal: probe frame, need not be normalised.
void encode_report_lux_request(std::uint32_t id, double lux, Vec3d normal, std::vector<std::byte>& out);

struct LinkResponse {
  std::uint32_t id = 0;
  Status status;                            ///< The probe's status; data_loss if its configuration is not known.
  std::optional<InfoAnswer> info;           ///< Response to Info.
  std::optional<double> scale;              ///< Response to ReportLux: the factor that was applied to radiance.
  std::optional<EstimatorState> estimator;  ///< Response to GetConfig, SetConfig; as decode_set_config_response().
};

/// data_loss if `bytes` are not a LinkResponse.
[[nodiscard]] Result<LinkResponse> decode_link_response(std::span<const std::byte> bytes);

/// A SetConfigRequest. The request of get_config is empty.
[[nodiscard]] std::string encode_set_config_request(const EstimatorUpdate& update);
[[nodiscard]] std::string encode_report_lux_request(double lux, Vec3d normal);

/// data_loss for bytes that are not a GetConfigResponse, or a configuration that this version does not know.
[[nodiscard]] Result<EstimatorState> decode_get_config_response(std::span<const std::byte> response);
/// The configuration after the change; no value from older firmware, which ignores EstimatorUpdate::panorama and
/// marker.
[[nodiscard]] Result<std::optional<EstimatorState>> decode_set_config_response(std::span<const std::byte> response);
/// The factor that was applied to radiance. data_loss for bytes that are not a ReportLuxResponse.
[[nodiscard]] Result<double> decode_report_lux_response(std::span<const std::byte> response);

}  // namespace lightwell
