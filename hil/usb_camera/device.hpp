// The whole camera as a USB device: what answers on the control endpoint, and the streaming endpoint behind it.
//   SetupPacket, Device
#pragma once

#include <cstdint>
#include <span>

#include "usb_camera/controls.hpp"
#include "usb_camera/descriptors.hpp"
#include "usb_camera/negotiation.hpp"
#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera {

/// USB 2.0, table 9-2.
struct SetupPacket {
  std::uint8_t request_type = 0, request = 0;
  std::uint16_t value = 0, index = 0, length = 0;
};

/// What the control endpoint answers: a stall, or bytes for the host (none where the host gave some).
struct SetupReply {
  bool stalled = false;
  Bytes data;
};

struct DeviceOptions {
  StreamOptions stream;
  SupportedFormats offer;
  std::uint32_t payload_bytes = 0;  ///< Negotiation's.
  Identity identity;
};

/// Requests since the program began.
struct DeviceCounts {
  std::uint64_t setups = 0;
  std::uint64_t stalls = 0;  ///< Of those, how many were answered by a stall.
  std::uint64_t resets = 0;  ///< Of the bus.
};

/// No thread, no clock, no socket: redir_port.hpp joins it to a host.
class Device {
 public:
  Device(const DeviceOptions& options, FrameSource& source, FrameLog& log);

  /// Plugged in: everything as at power-on.
  void power_on();
  /// The host resets the bus: no configuration, no stream. Controls keep their values, as power stays.
  void bus_reset();

  [[nodiscard]] SetupReply setup(const SetupPacket& packet, std::span<const std::uint8_t> data, TransferSink& sink);

  /// False for a number that there is not. 0 takes the configuration away.
  [[nodiscard]] bool set_configuration(std::uint8_t number);
  [[nodiscard]] std::uint8_t configuration() const { return configuration_; }
  /// Each interface has the one setting, 0; setting it stops a stream. False for any other.
  [[nodiscard]] bool set_interface(std::uint16_t interface, std::uint16_t setting);

  /// The pictures are of another scene: automatic exposure looks anew.
  void scene_changed();

  [[nodiscard]] Stream& stream() { return stream_; }
  [[nodiscard]] const Stream& stream() const { return stream_; }
  [[nodiscard]] const Controls& controls() const { return controls_; }
  [[nodiscard]] const SupportedFormats& offer() const { return negotiation_.offer(); }
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
