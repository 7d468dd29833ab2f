// Interface of a connection to a probe, and what all connections share.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/link_message.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

#include "core/clock_map.hpp"
#include "core/descriptor_receiver.hpp"
#include "core/uri.hpp"

namespace lightwell::core {

/// Owns one reader thread that passes messages to a DescriptorReceiver, from construction to destruction. The
/// destructor joins it within a second.
class Source {
 public:
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;
  virtual ~Source() = default;

  // As the methods of Probe; any thread; may block.

  [[nodiscard]] Result<EstimatorState> estimator() {
    const Result<LinkResponse> response = request(GetConfig{});
    if (!response) return response.status();
    if (!response->estimator) return unexpected_response();
    return *response->estimator;
  }
  [[nodiscard]] Status change_estimator(const EstimatorUpdate& update) {
    const Result<LinkResponse> response = request(update);
    if (!response) return response.status();
    if (response->estimator ||
        (update.panorama == EstimatorUpdate::Panorama{} && update.marker == EstimatorUpdate::Marker{}))
      return {};
    return {StatusCode::failed_precondition,
            name_ +
                ": the probe's firmware is older than this SDK and does not know the fields of `panorama` and "
                "`marker`: they stay as they were; update lightwelld there"};
  }
  [[nodiscard]] Result<double> report_lux(double lux, Vec3f normal) {
    const Result<LinkResponse> response = request(ReportLux{lux, vec_cast<double>(normal)});
    if (!response) return response.status();
    if (!response->scale) return unexpected_response();
    return *response->scale;
  }
  [[nodiscard]] Result<RecordingStatus> control_recording(RecordingAction action) {
    const Result<LinkResponse> response = request(action);
    if (!response) return response.status();
    if (!response->recording) return unexpected_response();
    return *response->recording;
  }
  [[nodiscard]] Result<CalibrationSummary> calibration() {
    const Result<LinkResponse> response = request(GetCalibration{});
    if (!response) return response.status();
    if (!response->calibration) return unexpected_response();
    return *response->calibration;
  }

 protected:
  /// `name` begins the messages of errors.
  explicit Source(std::string name) : name_(std::move(name)) {}

  [[nodiscard]] const std::string& name() const { return name_; }

  /// Sends a request and waits; an error status from the probe is returned as the error. failed_precondition for a link
  /// without commands.
  [[nodiscard]] virtual Result<LinkResponse> request(const LinkCommand& command) = 0;

  /// The error of GetConfig if the probe does not have that call.
  [[nodiscard]] Status no_get_config() const {
    return {StatusCode::failed_precondition,
            name_ +
                ": the probe's firmware is older than this SDK and does not report its configuration; update "
                "lightwelld there"};
  }
  [[nodiscard]] Status unexpected_response() const {
    return {StatusCode::internal, name_ + ": the probe's response does not match the request"};
  }

 private:
  const std::string name_;
};

/// Period of the requests of Info on a link of its own. The first round trips follow each other quickly: the very first
/// includes the handshake, and the shortest of several gives a much better clock offset than one.
inline constexpr Duration kInfoPeriod{1'000'000'000}, kFirstInfoPeriod{20'000'000};
inline constexpr int kFirstRoundTrips = 8;

[[nodiscard]] inline ProbeInfo probe_info(const StatusSnapshot& status, const ClockMap& clock, HostTime now) {
  return {.name = status.probe_name,
          .id = status.probe_id,
          .calibration_id = status.calibration_id,
          .version = status.version,
          .camera = status.camera,
          .clock_offset = clock.offset(now),
          .clock_uncertainty = clock.uncertainty(now),
          .clock_drift_ppm = 1e6 * clock.drift(),
          .counters = status.counters,
          .T_world_probe = status.T_world_probe,
          .temperature_c = status.temperature_c,
          .links = status.links,
          .recording = status.recording};
}

/// Starts to connect; DescriptorReceiver::describe() reports success, for a recording at once. The receiver must
/// outlive the source. Errors of gRPC and WebSocket: those of credentials_for(); of USB: those of
/// make_libusb_transport(); of MQTT: a login in plain text; of a recording: those of opening it. failed_precondition if
/// the SDK was built without the link.
[[nodiscard]] Result<std::unique_ptr<Source>> make_source(const GrpcAddress& address, ProbeOptions options,
                                                          DescriptorReceiver& receiver);
[[nodiscard]] Result<std::unique_ptr<Source>> make_source(const WebAddress& address, ProbeOptions options,
                                                          DescriptorReceiver& receiver);
[[nodiscard]] Result<std::unique_ptr<Source>> make_source(const UsbAddress& address, const ProbeOptions& options,
                                                          DescriptorReceiver& receiver);
[[nodiscard]] Result<std::unique_ptr<Source>> make_source(const MqttAddress& address, const ProbeOptions& options,
                                                          DescriptorReceiver& receiver);
[[nodiscard]] Result<std::unique_ptr<Source>> make_source(const ReplayPath& replay, const ProbeOptions& options,
                                                          DescriptorReceiver& receiver);

class UsbTransport;

/// A connection by USB with any transport.
[[nodiscard]] std::unique_ptr<Source> make_usb_source(std::unique_ptr<UsbTransport> transport,
                                                      const UsbAddress& address, const ProbeOptions& options,
                                                      DescriptorReceiver& receiver);

}  // namespace lightwell::core
