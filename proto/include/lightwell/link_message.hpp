// A host's requests and the probe's responses on a link without its own RPC (USB):
// proto/lightwell/v1/link_message.proto.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status_codec.hpp>

namespace lightwell {

/// Each writes into `out`, whose memory is reused.
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

}  // namespace lightwell
