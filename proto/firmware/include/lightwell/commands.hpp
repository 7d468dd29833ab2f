// The commands of a probe that its links call, and the execution of a client's requests by them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration_summary.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

namespace lightwell {

/// The bytes of a JPEG picture; null: none.
using PreviewJpeg = std::shared_ptr<const std::vector<std::byte>>;

/// Commands that links receive from clients. Called from any of a link's threads.
class Commands {
 public:
  virtual ~Commands() = default;

  [[nodiscard]] virtual StatusSnapshot status() const = 0;
  [[nodiscard]] virtual EstimatorConfig estimator() const = 0;
  /// The active estimator, which determines the available options.
  [[nodiscard]] virtual EstimatorKind estimator_kind() const = 0;
  /// Changes the fields of `update` atomically: concurrent updates do not overwrite each other's fields. Takes effect
  /// with the next capture. invalid_argument changes nothing.
  [[nodiscard]] virtual Status update_estimator(const EstimatorUpdate& update) = 0;
  /// Scales radiance so that the irradiance at `normal` (unit, probe frame) is `lux`; returns the factor.
  [[nodiscard]] virtual Result<double> report_lux(double lux, Vec3d normal) = 0;
  /// Does not change.
  [[nodiscard]] virtual CalibrationSummary calibration() const = 0;
  /// Starts or stops the probe's own recording; its state after the action. failed_precondition, resource_exhausted: as
  /// ControlRecording of probe_service.proto. unavailable: the disk does not respond. Returns within a second.
  [[nodiscard]] virtual Result<RecordingStatus> control_recording(RecordingAction action) = 0;
  /// A small picture of what the camera sees, at most 320 x 160, sRGB, not older than 0.1 s; there is a new one at most
  /// once a second. It does not wait: where there is none, it requests one of a next frame and returns null, and the
  /// link calls again soon. failed_precondition, with the remedy: the owner lets nobody have pictures.
  [[nodiscard]] virtual Result<PreviewJpeg> preview() = 0;
};

enum class ProbeCall : std::uint8_t { info, set_config, report_lux, get_config, control_recording, get_calibration };

/// For a link with its own RPC: the response in binary form. data_loss if `request` is not a request of this call;
/// otherwise the error of `commands`, or why they were not called. Calls `commands` on this thread.
[[nodiscard]] Result<std::string> answer_probe_call(ProbeCall call, std::string_view request, Commands& commands);

/// Begins the stream of captured planes to the client of a link, or repeats the whole plane. An error refuses the
/// request.
using StartPlaneStream = std::function<Status()>;

/// For a link without (USB, WebSocket): executes a LinkRequest and writes the LinkResponse, at most
/// kMaxLinkMessageBytes, into `response`. Every LinkRequest has a response, also one that is refused. data_loss if
/// `request` is not a LinkRequest; `response` is then empty. Calls `commands` and `start_plane_stream` on this thread;
/// an empty `start_plane_stream`: the link has no such stream, and the request is refused as one that is not known.
[[nodiscard]] Status answer_link_request(std::span<const std::byte> request, Commands& commands,
                                         std::vector<std::byte>& response,
                                         const StartPlaneStream& start_plane_stream = {});

/// A LinkRequest `authenticate`. answer_link_request() answers it without a look at the token.
struct AuthenticateRequest {
  std::uint32_t id = 0;
  std::string token;
};
/// No value for any other bytes.
[[nodiscard]] std::optional<AuthenticateRequest> decode_authenticate(std::span<const std::byte> request);

/// Disables protobuf's own log for this process. It writes to stderr for each message whose text is not UTF-8, so that
/// clients could fill a daemon's log. Call it once, at the start of a program.
void silence_protobuf_log();

}  // namespace lightwell
