// Interface of a connection to a probe, and functions that all connections share.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/result.hpp>

#include "core/descriptor_receiver.hpp"
#include "core/uri.hpp"

namespace lightwell::core {

/// Owns one reader thread that passes messages to a DescriptorReceiver, from construction to destruction. The
/// destructor joins it within a second.
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

/// The error of GetConfig if the probe does not have that call.
[[nodiscard]] inline Status no_get_config(const std::string& probe) {
  return {StatusCode::failed_precondition,
          probe +
              ": the probe's firmware is older than this SDK and does not report its configuration; update lightwelld "
              "there"};
}

/// Checks a change that the probe accepted; `now` is the configuration that it reported, if it did.
[[nodiscard]] inline Status check_change(const std::string& probe, const EstimatorUpdate& update,
                                         const std::optional<EstimatorState>& now) {
  if (now || (update.panorama == EstimatorUpdate::Panorama{} && update.marker == EstimatorUpdate::Marker{})) return {};
  return {StatusCode::failed_precondition,
          probe +
              ": the probe's firmware is older than this SDK and does not know the fields of `panorama` and `marker`: "
              "they stay as they were; update lightwelld there"};
}

/// Starts to connect; DescriptorReceiver::describe() reports success. The receiver must outlive the source. The errors
/// of credentials_for(); failed_precondition if the SDK was built without gRPC.
[[nodiscard]] Result<std::unique_ptr<Source>> make_grpc_source(const GrpcAddress& address, ProbeOptions options,
                                                               DescriptorReceiver& receiver);

/// As make_grpc_source(), with libusb. The errors of make_libusb_transport().
[[nodiscard]] Result<std::unique_ptr<Source>> make_usb_source(const UsbAddress& address, const ProbeOptions& options,
                                                              DescriptorReceiver& receiver);

/// The same with an MQTT broker. Only if the SDK was built with MQTT.
[[nodiscard]] std::unique_ptr<Source> make_mqtt_source(const MqttAddress& address, const ProbeOptions& options,
                                                       DescriptorReceiver& receiver);

/// The errors of opening the recording. On success, DescriptorReceiver::describe() has been called.
[[nodiscard]] Result<std::unique_ptr<Source>> make_replay_source(const ReplayPath& replay,
                                                                 DescriptorReceiver& receiver);

}  // namespace lightwell::core
