// A host's requests and the probe's responses as bytes: messages of link_message.proto on a link without its own RPC
// (USB), and of probe_service.proto on a link with one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <lightwell/calibration_summary.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

namespace lightwell {

struct GetConfig {};
struct GetCalibration {};
struct ReportLux {
  double lux = 0;
  Vec3d normal;  ///< Probe frame, need not be normalised.
};
/// A request other than Info. EstimatorUpdate stands for SetConfig, RecordingAction for
/// ControlRecording.
using LinkCommand = std::variant<GetConfig, EstimatorUpdate, ReportLux, RecordingAction, GetCalibration>;

/// A LinkRequest, written into `out`, whose memory is reused.
void encode_info_request(std::uint32_t id, std::vector<std::byte>& out);
/// Requests the stream of captured planes; its response has a status and nothing else.
void encode_plane_request(std::uint32_t id, std::vector<std::byte>& out);
void encode_link_request(std::uint32_t id, const LinkCommand& command, std::vector<std::byte>& out);

struct LinkResponse {
  std::uint32_t id = 0;
  Status status;                   ///< The probe's status; data_loss if its configuration is not known.
  std::optional<InfoAnswer> info;  ///< Response to Info.
  std::optional<double> scale;     ///< Response to ReportLux: the factor that was applied to radiance.
  /// Response to GetConfig and SetConfig: the configuration, in SetConfig after the change. No value from older
  /// firmware, which ignores EstimatorUpdate::panorama and marker.
  std::optional<EstimatorState> estimator;
  std::optional<RecordingStatus> recording{};       ///< Response to ControlRecording: the state after the action.
  std::optional<CalibrationSummary> calibration{};  ///< Response to GetCalibration.
};

/// data_loss if `bytes` are not a LinkResponse.
[[nodiscard]] Result<LinkResponse> decode_link_response(std::span<const std::byte> bytes);

/// The request of the call of ProbeService.
[[nodiscard]] std::string encode_rpc_request(const LinkCommand& command);
/// The response of that call. data_loss for bytes that are not its message.
[[nodiscard]] Result<LinkResponse> decode_rpc_response(const LinkCommand& command, std::span<const std::byte> response);

}  // namespace lightwell
