// Requests and responses of a link that has no calls of its own (USB): proto/lightwell/v1/link_message.proto.
//   encode_..._request       the host asks
//   answer_link_request      the probe answers, by its Commands
//   decode_link_response     the host reads the answer
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

/// Each into `out`, whose memory is used again.
void encode_info_request(std::uint32_t id, std::vector<std::byte>& out);
void encode_get_config_request(std::uint32_t id, std::vector<std::byte>& out);
void encode_set_config_request(std::uint32_t id, const EstimatorUpdate& update, std::vector<std::byte>& out);
/// normal: probe frame, need not be normalised.
void encode_report_lux_request(std::uint32_t id, double lux, Vec3d normal, std::vector<std::byte>& out);

/// Does what a LinkRequest asks and puts the LinkResponse into `response`, at most kMaxLinkMessageBytes. Every message
/// that is a LinkRequest has a response, refusals too. data_loss where `request` is none: then there is nothing to
/// answer, and `response` is empty. Calls `commands` on this thread.
[[nodiscard]] Status answer_link_request(std::span<const std::byte> request, Commands& commands,
                                         std::vector<std::byte>& response);

struct LinkResponse {
  std::uint32_t id = 0;
  Status status;                            ///< What the probe said; data_loss where its configuration is none.
  std::optional<InfoAnswer> info;           ///< Where Info was asked.
  std::optional<double> scale;              ///< Where lux was reported: the factor that was applied to radiance.
  std::optional<EstimatorState> estimator;  ///< Where it was asked for or changed; as decode_set_config_response().
};

/// data_loss where it is no LinkResponse.
[[nodiscard]] Result<LinkResponse> decode_link_response(std::span<const std::byte> bytes);

}  // namespace lightwell
