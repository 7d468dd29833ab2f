// A link to a probe: what the links have in common.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <lightwell/config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/result.hpp>

#include "core/descriptor_receiver.hpp"
#include "core/uri.hpp"

namespace lightwell::core {

/// Owns one reader thread that feeds an DescriptorReceiver, from construction to destruction. The destructor
/// ends it within a second.
class Source {
 public:
  Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;
  virtual ~Source() = default;

  /// As the methods of Probe; any thread; may block.
  [[nodiscard]] virtual Result<EstimatorState> estimator() = 0;
  [[nodiscard]] virtual Status change_estimator(const EstimatorUpdate& update) = 0;
  [[nodiscard]] virtual Result<double> report_lux(double lux, Vec3f normal) = 0;
};

/// What came of GetConfig where the probe does not have that call.
[[nodiscard]] inline Status no_get_config(const std::string& probe) {
  return {StatusCode::failed_precondition,
          probe +
              ": the probe's firmware is older than this SDK and does not tell its configuration; update lightwelld "
              "there"};
}

/// Of a change that the probe took, with what it said to hold now.
[[nodiscard]] inline Status check_change(const std::string& probe, const EstimatorUpdate& update,
                                         const std::optional<EstimatorState>& now) {
  if (now || (update.panorama == EstimatorUpdate::Panorama{} && update.marker == EstimatorUpdate::Marker{})) return {};
  return {StatusCode::failed_precondition,
          probe +
              ": the probe's firmware is older than this SDK and does not know the fields of `panorama` and `marker`: "
              "they stay as they were; update lightwelld there"};
}

/// Begins to connect; DescriptorReceiver::describe() tells of success. The intake outlives the source.
[[nodiscard]] std::unique_ptr<Source> make_grpc_source(const GrpcAddress& address, const ProbeOptions& options,
                                                       DescriptorReceiver& receiver);

/// As make_grpc_source(), by libusb. The errors of make_libusb_transport().
[[nodiscard]] Result<std::unique_ptr<Source>> make_usb_source(const UsbAddress& address, const ProbeOptions& options,
                                                              DescriptorReceiver& receiver);

/// The same at a broker. Only where the SDK was built with MQTT.
[[nodiscard]] std::unique_ptr<Source> make_mqtt_source(const MqttAddress& address, const ProbeOptions& options,
                                                       DescriptorReceiver& receiver);

/// The recording's errors; DescriptorReceiver::describe() was called where it is good.
[[nodiscard]] Result<std::unique_ptr<Source>> make_replay_source(const ReplayPath& replay, DescriptorReceiver& receiver);

}  // namespace lightwell::core
