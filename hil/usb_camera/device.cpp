#include "usb_camera/device.hpp"

#include <optional>
#include <utility>

namespace lightwell::usb_camera {
namespace {

// USB 2.0, tables 9-3 to 9-6.
constexpr std::uint8_t kToHost = 0x80, kTypeMask = 0x60, kStandard = 0x00, kClass = 0x20, kRecipientMask = 0x1F;
constexpr std::uint8_t kToDevice = 0, kToInterface = 1, kToEndpoint = 2;
constexpr std::uint8_t kGetStatus = 0, kClearFeature = 1, kSetFeature = 3, kSetAddress = 5, kGetDescriptor = 6,
                       kGetConfiguration = 8, kSetConfiguration = 9, kGetInterface = 10, kSetInterface = 11;
constexpr std::uint16_t kEndpointHalt = 0;
constexpr std::uint8_t kRequestErrorCode = 0x02;  // Of the control interface (4.2.1.2).
constexpr std::uint8_t kStreamErrorCode = 0x06;   // Of the streaming interface (4.3.1.7).

const SetupReply kStall{true, {}};
const SetupReply kDone{false, {}};

SetupReply stall_unless(bool done) { return done ? kDone : kStall; }

/// A control with the last request's error code: one byte, read-only.
ControlReply error_code(RequestError last, ControlRequest request) {
  switch (request) {
    case ControlRequest::get_cur:
      return {RequestError::none, {static_cast<std::uint8_t>(last)}};
    case ControlRequest::get_len:
      return {RequestError::none, {1, 0}};
    case ControlRequest::get_info:
      return {RequestError::none, {0x01}};
    default:
      return {RequestError::invalid_request, {}};
  }
}

bool is_video_request(std::uint8_t request) {
  return request == static_cast<std::uint8_t>(ControlRequest::set_cur) ||
         (request >= static_cast<std::uint8_t>(ControlRequest::get_cur) &&
          request <= static_cast<std::uint8_t>(ControlRequest::get_def));
}

}  // namespace

Device::Device(const DeviceOptions& options, FrameSource& source, FrameLog& log)
    : options_(options),
      source_(source),
      negotiation_(options.formats, options.payload_bytes),
      stream_(options.stream, source, log) {
  power_on();
}

void Device::power_on() {
  configuration_ = 0;
  controls_.reset();
  controls_.set_automatic(source_.automatic_exposure_s(), 1.0 / options_.formats.default_rate);
  negotiation_.reset();
  stream_.reset();
  last_control_error_ = last_stream_error_ = RequestError::none;
}

void Device::bus_reset() {
  ++counts_.resets;
  configuration_ = 0;
  negotiation_.reset();
  stream_.reset();
}

void Device::scene_changed() {
  const int rate =
      stream_.negotiated_format() ? stream_.negotiated_format()->format.rate : options_.formats.default_rate;
  controls_.set_automatic(source_.automatic_exposure_s(), 1.0 / rate);
  stream_.set(controls_.settings());
}

SetupReply Device::setup(const SetupPacket& packet, Data data, TransferSink& sink) {
  ++counts_.setups;
  SetupReply reply = kStall;
  const std::uint8_t type = packet.request_type & kTypeMask;
  if (type == kStandard) reply = standard(packet, sink);
  if (type == kClass) reply = video(packet, data);
  if (reply.stalled) ++counts_.stalls;
  if (reply.data.size() > packet.length) reply.data.resize(packet.length);
  return reply;
}

bool Device::set_configuration(std::uint8_t number) {
  if (number > 1) return false;
  configuration_ = number;
  negotiation_.reset();
  stream_.reset();
  return true;
}

bool Device::set_interface(std::uint16_t interface, std::uint16_t setting) {
  if (configuration_ == 0 || interface > kStreamingInterface || setting != 0) return false;
  if (interface == kStreamingInterface) stream_.clear_halt();
  return true;
}

SetupReply Device::standard(const SetupPacket& packet, TransferSink& sink) {
  switch (packet.request) {
    case kGetDescriptor:
      return descriptor(packet);
    case kSetAddress:
      return kDone;
    case kSetConfiguration:
      return stall_unless(packet.value <= 1 && set_configuration(static_cast<std::uint8_t>(packet.value)));
    case kGetConfiguration:
      return {false, {configuration_}};
    case kSetInterface:
      return stall_unless(set_interface(packet.index, packet.value));
    case kGetInterface:
      if (configuration_ == 0 || packet.index > kStreamingInterface) return kStall;
      return {false, {0}};
    case kGetStatus:
      return status(packet);
    case kClearFeature:
    case kSetFeature:
      return feature(packet, sink);
    default:
      return kStall;
  }
}

SetupReply Device::descriptor(const SetupPacket& packet) const {
  if (packet.request_type != (kToHost | kToDevice)) return kStall;
  const auto index = static_cast<std::uint8_t>(packet.value & 0xFF);
  switch (packet.value >> 8) {
    case 1:
      return {false, device_descriptor()};
    case 2:
      if (index != 0) return kStall;
      return {false, configuration_descriptor(options_.formats)};
    case 3: {
      std::optional<Bytes> text = string_descriptor(options_.identity, index);
      if (!text) return kStall;
      return {false, std::move(*text)};
    }
    case 6:
      return {false, device_qualifier()};
    default:
      return kStall;
  }
}

SetupReply Device::feature(const SetupPacket& packet, TransferSink& sink) {
  const bool of_stream = (packet.request_type & kRecipientMask) == kToEndpoint && packet.value == kEndpointHalt &&
                         packet.index == kStreamingEndpoint && configuration_ != 0;
  if (!of_stream) {
    // Clearing the control endpoint's halt always succeeds, because it ends by itself; no other feature is supported.
    return stall_unless((packet.request_type & kRecipientMask) == kToEndpoint && (packet.index & 0x7F) == 0);
  }
  if (packet.request == kSetFeature) {
    stream_.halt(sink);
  } else {
    stream_.clear_halt();
  }
  return kDone;
}

SetupReply Device::status(const SetupPacket& packet) const {
  if ((packet.request_type & kToHost) == 0) return kStall;
  switch (packet.request_type & kRecipientMask) {
    case kToDevice:
      return {false, {0, 0}};
    case kToInterface:
      if (packet.index > kStreamingInterface) return kStall;
      return {false, {0, 0}};
    case kToEndpoint: {
      if ((packet.index & 0x7F) == 0) return {false, {0, 0}};
      if (packet.index != kStreamingEndpoint) return kStall;
      return {false, {static_cast<std::uint8_t>(stream_.halted() ? 1 : 0), 0}};
    }
    default:
      return kStall;
  }
}

SetupReply Device::video(const SetupPacket& packet, Data data) {
  const auto interface = static_cast<std::uint8_t>(packet.index & 0xFF);
  const auto unit = static_cast<std::uint8_t>(packet.index >> 8);
  const auto selector = static_cast<std::uint8_t>(packet.value >> 8);
  const bool to_host = (packet.request_type & kToHost) != 0;
  const bool known = (packet.request_type & kRecipientMask) == kToInterface && interface <= kStreamingInterface;
  if (!known || configuration_ == 0) return kStall;

  ControlReply reply{RequestError::invalid_request, {}};
  const bool direction_fits = to_host == (packet.request != static_cast<std::uint8_t>(ControlRequest::set_cur));
  const bool of_control = interface == kControlInterface;
  const auto request = static_cast<ControlRequest>(packet.request);
  if (is_video_request(packet.request) && direction_fits)
    reply =
        of_control ? control_interface(unit, selector, request, data) : streaming_interface(selector, request, data);
  // Reading the error code does not change it.
  const bool reads_error =
      (of_control && unit == 0 && selector == kRequestErrorCode) || (!of_control && selector == kStreamErrorCode);
  if (!reads_error) (of_control ? last_control_error_ : last_stream_error_) = reply.error;
  return {!reply.ok(), std::move(reply.data)};
}

ControlReply Device::control_interface(std::uint8_t unit, std::uint8_t selector, ControlRequest request, Data data) {
  if (unit == 0) {
    if (selector == kRequestErrorCode) return error_code(last_control_error_, request);
    return {RequestError::invalid_control, {}};
  }
  ControlReply reply = controls_.request(unit, selector, request, data);
  if (request == ControlRequest::set_cur && reply.ok()) stream_.set(controls_.settings());
  return reply;
}

ControlReply Device::streaming_interface(std::uint8_t selector, ControlRequest request, Data data) {
  if (selector == kStreamErrorCode) return error_code(last_stream_error_, request);
  ControlReply reply = negotiation_.request(selector, request, data);
  if (const std::optional<NegotiatedFormat> agreed = negotiation_.take_commit()) {
    controls_.set_automatic(source_.automatic_exposure_s(), 1.0 / agreed->format.rate);
    if (!stream_.arm(*agreed, controls_.settings()).ok()) return {RequestError::not_ready, {}};
  }
  return reply;
}

}  // namespace lightwell::usb_camera
