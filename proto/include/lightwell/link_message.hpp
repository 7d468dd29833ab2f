// Requests and responses of a link without its own RPC (USB): proto/lightwell/v1/link_message.proto.
//   encode_..._request       host: encodes a request
//   answer_link_request      probe: executes a request with its Commands
//   decode_link_response     host: decodes the response
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>
#include <lightwell/status_codec.hpp>

namespace lightwell {

/// Each writes into `out`, whose memory is reused.
void encode_info_request(std::uint32_t id, std::vector<std::byte>& out);
void encode_get_config_request(std::uint32_t id, std::vector<std::byte>& out);
void encode_set_config_request(std::uint32_t id, const EstimatorUpdate& update, std::vector<std::byte>& out);
/// normal: probe frame, need not be normalised.
void encode_report_lux_request(std::uint32_t id, double lux, Vec3d normal, std::vector<std::byte>& out);

/// Executes a LinkRequest and writes the LinkResponse, at most kMaxLinkMessageBytes, into `response`. Every LinkRequest
/// has a response, also one that is refused. data_loss if `request` is not a LinkRequest; `response` is then empty.
/// Calls `commands` on this thread.
[[nodiscard]] Status answer_link_request(std::span<const std::byte> request, Commands& commands,
                                         std::vector<std::byte>& response);

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
