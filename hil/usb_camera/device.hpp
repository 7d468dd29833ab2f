// The camera as a USB device: the control endpoint and the streaming endpoint.
#pragma once

#include <cstdint>
#include <span>

#include "usb_camera/controls.hpp"
#include "usb_camera/descriptors.hpp"
#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera {

/// USB 2.0, table 9-2.
struct SetupPacket {
  std::uint8_t request_type = 0, request = 0;
  std::uint16_t value = 0, index = 0, length = 0;
};

/// Response of the control endpoint: a stall, or data for the host (empty for a request towards the device).
struct SetupReply {
  bool stalled = false;
  Bytes data;
};

struct DeviceOptions {
  StreamOptions stream;
  SupportedFormats formats;
  std::uint32_t payload_bytes = 0;  ///< See Negotiation.
  Identity identity;
};

/// Requests since the program began.
struct DeviceCounts {
  std::uint64_t setups = 0;
  std::uint64_t stalls = 0;  ///< Setup requests that were answered by a stall.
  std::uint64_t resets = 0;  ///< Bus resets.
};

/// Has no thread, clock or socket; redir_port.cpp connects it to a host.
class Device {
 public:
  Device(const DeviceOptions& options, FrameSource& source, FrameLog& log);

  /// Resets everything, as when the device is plugged in.
  void power_on();
  /// Handles a bus reset: ends configuration and stream. Controls keep their values, because the device stays powered.
  void bus_reset();

  [[nodiscard]] SetupReply setup(const SetupPacket& packet, std::span<const std::uint8_t> data, TransferSink& sink);

  /// Handles SET_CONFIGURATION; 0: unconfigured. False for an unknown number.
  [[nodiscard]] bool set_configuration(std::uint8_t number);
  [[nodiscard]] std::uint8_t configuration() const { return configuration_; }
  /// Handles SET_INTERFACE. Each interface has only the alternate setting 0; setting it on the streaming interface
  /// stops the stream. False for any other setting.
  [[nodiscard]] bool set_interface(std::uint16_t interface, std::uint16_t setting);

  /// To be called when the frame source shows another scene: updates automatic exposure.
  void scene_changed();

  [[nodiscard]] Stream& stream() { return stream_; }
  [[nodiscard]] const Stream& stream() const { return stream_; }
  [[nodiscard]] const Controls& controls() const { return controls_; }
  [[nodiscard]] const SupportedFormats& formats() const { return negotiation_.formats(); }
  [[nodiscard]] const DeviceCounts& counts() const { return counts_; }
  void reset_counts() { counts_ = {}; }

 private:
  using Data = std::span<const std::uint8_t>;
  [[nodiscard]] SetupReply standard(const SetupPacket& packet, TransferSink& sink);
  [[nodiscard]] SetupReply descriptor(const SetupPacket& packet) const;
  [[nodiscard]] SetupReply feature(const SetupPacket& packet, TransferSink& sink);
  [[nodiscard]] SetupReply status(const SetupPacket& packet) const;
  [[nodiscard]] SetupReply video(const SetupPacket& packet, Data data);
  [[nodiscard]] ControlReply control_interface(std::uint8_t unit, std::uint8_t selector, ControlRequest request,
                                               Data data);
  [[nodiscard]] ControlReply streaming_interface(std::uint8_t selector, ControlRequest request, Data data);

  DeviceOptions options_;
  FrameSource& source_;
  Controls controls_;
  Negotiation negotiation_;
  Stream stream_;
  std::uint8_t configuration_ = 0;
  RequestError last_control_error_ = RequestError::none;
  RequestError last_stream_error_ = RequestError::none;
  DeviceCounts counts_;
};

}  // namespace lightwell::usb_camera
