#include "usb_camera/descriptors.hpp"

#include <algorithm>
#include <initializer_list>

#include "usb_camera/controls.hpp"

namespace lightwell::usb_camera {
namespace {

constexpr std::uint8_t kInterfaceClass = 0x0E;  // Video.
constexpr std::uint8_t kClassInterface = 0x24;  // CS_INTERFACE.

// GUIDs of uncompressed formats: the four characters, then the same twelve bytes (USB_Video_Payload_Uncompressed, 2.2).
constexpr std::array<std::uint8_t, 12> kGuidTail = {0x00, 0x00, 0x10, 0x00, 0x80, 0x00,
                                                    0x00, 0xAA, 0x00, 0x38, 0x9B, 0x71};

void append(Bytes& out, std::initializer_list<unsigned> bytes) {
  for (const unsigned b : bytes) out.push_back(static_cast<std::uint8_t>(b));
}

void append(Bytes& out, std::span<const std::uint8_t> bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); }

void set16(Bytes& out, std::size_t at, std::size_t value) {
  out[at] = static_cast<std::uint8_t>(value);
  out[at + 1] = static_cast<std::uint8_t>(value >> 8);
}

void append_frame(Bytes& out, const SupportedFormats& formats, Encoding encoding, std::size_t number) {
  const FrameSize size = formats.sizes[number - 1];
  const std::size_t bytes = largest_frame(encoding, size);
  const auto bits_per_second = [&](int rate) {
    return std::min<std::uint64_t>(0xFFFFFFFF, std::uint64_t{8} * bytes * static_cast<std::uint64_t>(rate));
  };
  // VS_FRAME_UNCOMPRESSED (5) and VS_FRAME_MJPEG (7) have the same fields.
  append(out, {static_cast<unsigned>(26 + 4 * formats.rates.size()), kClassInterface,
               encoding == Encoding::mjpeg ? 7U : 5U, static_cast<unsigned>(number), 0});
  put(out, static_cast<std::uint64_t>(size.width), 2);
  put(out, static_cast<std::uint64_t>(size.height), 2);
  put(out, bits_per_second(formats.rates.back()), 4);
  put(out, bits_per_second(formats.rates.front()), 4);
  put(out, bytes, 4);
  put(out, interval_of(formats.default_rate), 4);
  put(out, formats.rates.size(), 1);
  for (const int rate : formats.rates) put(out, interval_of(rate), 4);
}

void append_format(Bytes& out, const SupportedFormats& formats, std::size_t number) {
  const Encoding encoding = formats.encodings[number - 1];
  const auto frames = static_cast<unsigned>(formats.sizes.size());
  if (encoding == Encoding::mjpeg) {
    // VS_FORMAT_MJPEG: sizes vary from frame to frame.
    append(out, {11, kClassInterface, 6, static_cast<unsigned>(number), frames, 0, 1, 0, 0, 0, 0});
  } else {
    const bool yuyv = encoding == Encoding::yuyv;
    append(out, {27, kClassInterface, 4, static_cast<unsigned>(number), frames});
    append(out, yuyv ? std::initializer_list<unsigned>{'Y', 'U', 'Y', '2'}
                     : std::initializer_list<unsigned>{'N', 'V', '1', '2'});
    append(out, kGuidTail);
    append(out, {yuyv ? 16U : 12U, 1, 0, 0, 0, 0});
  }
  for (std::size_t frame = 1; frame <= formats.sizes.size(); ++frame) append_frame(out, formats, encoding, frame);
  // Color matching (3.9.2.6): Rec. 709 primaries, sRGB transfer, SMPTE 170M (BT.601) matrix.
  append(out, {6, kClassInterface, 0x0D, 1, 1, 4});
}

void append_video_control(Bytes& out) {
  append(out, {9, 4, kControlInterface, 0, 0, kInterfaceClass, 1, 0, 0});
  const std::size_t header = out.size();
  // 3.7.2: version 1.1, total length (filled in below), clock, one streaming interface.
  append(out, {13, kClassInterface, 1, 0x10, 0x01, 0, 0});
  put(out, kClockFrequency, 4);
  append(out, {1, kStreamingInterface});
  // 3.7.2.3, a camera terminal (type 0x0201) without zoom.
  append(out, {18, kClassInterface, 2, kCameraTerminal, 0x01, 0x02, 0, 0, 0, 0, 0, 0, 0, 0, 3});
  put(out, control_bitmap(kCameraTerminal), 3);
  // 3.7.2.5, the processing unit behind it; no analogue video.
  append(out, {13, kClassInterface, 5, kProcessingUnit, kCameraTerminal, 0, 0, 3});
  put(out, control_bitmap(kProcessingUnit), 3);
  append(out, {0, 0});
  // 3.7.2.2, an output terminal for streaming (type 0x0101).
  append(out, {9, kClassInterface, 3, kOutputTerminal, 0x01, 0x01, 0, kProcessingUnit, 0});
  set16(out, header + 5, out.size() - header);
}

void append_video_streaming(Bytes& out, const SupportedFormats& formats) {
  append(out, {9, 4, kStreamingInterface, 0, 1, kInterfaceClass, 2, 0, 0});
  const std::size_t header = out.size();
  const std::size_t count = formats.encodings.size();
  // 3.9.2.1: no still images, no hardware trigger, no controls per format.
  append(out, {static_cast<unsigned>(13 + count), kClassInterface, 1, static_cast<unsigned>(count), 0, 0,
               kStreamingEndpoint, 0, kOutputTerminal, 0, 0, 0, 1});
  for (std::size_t i = 0; i < count; ++i) append(out, {0});
  for (std::size_t number = 1; number <= count; ++number) append_format(out, formats, number);
  set16(out, header + 4, out.size() - header);
  append(out, {7, 5, kStreamingEndpoint, 2, kBulkPacket & 0xFF, kBulkPacket >> 8, 0});
}

}  // namespace

Bytes device_descriptor() {
  Bytes out;
  // Class EF/02/01: the interfaces are grouped by an interface association descriptor.
  append(out, {18, 1, 0x00, 0x02, 0xEF, 0x02, 0x01, 64});
  put(out, kVendor, 2);
  put(out, kProduct, 2);
  put(out, kRelease, 2);
  append(out, {1, 2, 3, 1});
  return out;
}

Bytes device_qualifier() {
  Bytes out;
  append(out, {10, 6, 0x00, 0x02, 0xEF, 0x02, 0x01, 64, 0, 0});
  return out;
}

Bytes configuration_descriptor(const SupportedFormats& formats) {
  Bytes out;
  // Powered by the bus, 500 mA.
  append(out, {9, 2, 0, 0, 2, 1, 0, 0x80, 250});
  append(out, {8, 0x0B, kControlInterface, 2, kInterfaceClass, 3, 0, 0});
  append_video_control(out);
  append_video_streaming(out, formats);
  set16(out, 2, out.size());
  return out;
}

std::optional<Bytes> string_descriptor(const Identity& identity, std::uint8_t index) {
  if (index == 0) return Bytes{4, 3, 0x09, 0x04};
  const std::array<const std::string*, 3> texts = {&identity.manufacturer, &identity.product, &identity.serial};
  if (index > texts.size()) return std::nullopt;
  // The length is one byte; our texts are ASCII, which is the low half of UTF-16.
  const std::string text = texts[index - 1]->substr(0, 126);
  Bytes out = {static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) put(out, static_cast<unsigned char>(c), 2);
  return out;
}

}  // namespace lightwell::usb_camera
