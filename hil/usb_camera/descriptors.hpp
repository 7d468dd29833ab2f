// The camera's formats and the USB descriptors that list them: USB 2.0, chapter 9, and the USB Video Class 1.1 (USB
// Device Class Definition for Video Devices, revision 1.1; section numbers below refer to it).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lightwell::usb_camera {

using Bytes = std::vector<std::uint8_t>;

/// Appends the lowest `bytes` bytes of an integer, least significant first, as USB transmits them.
inline void put(Bytes& out, std::uint64_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// Reads an integer of `bytes` bytes; bytes beyond the end are zero.
[[nodiscard]] inline std::uint32_t get(std::span<const std::uint8_t> in, std::size_t at, std::size_t bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes && at + i < in.size(); ++i)
    value |= static_cast<std::uint32_t>(in[at + i]) << (8 * i);
  return value;
}

enum class Encoding : std::uint8_t { yuyv, nv12, mjpeg };

[[nodiscard]] constexpr std::string_view to_string(Encoding encoding) {
  return std::array{"yuyv", "nv12", "mjpeg"}[static_cast<std::size_t>(encoding)];
}

struct FrameSize {
  int width = 0, height = 0;
  friend bool operator==(const FrameSize&, const FrameSize&) = default;
};

struct SupportedFormats {
  std::vector<Encoding> encodings = {Encoding::yuyv, Encoding::nv12, Encoding::mjpeg};
  /// The same for each encoding; the first one is the default.
  std::vector<FrameSize> sizes;
  /// In frames per second, in descending order.
  std::vector<int> rates = {60, 30, 15};
  int default_rate = 30;
};

/// 4:3 and 16:9 for rigs with one image per lens; 2:1 for the rig "equirect".
[[nodiscard]] inline SupportedFormats formats_for(std::string_view rig) {
  SupportedFormats formats;
  if (rig == "equirect") {
    formats.sizes = {{640, 320}, {320, 160}, {1280, 640}, {1920, 960}};
  } else {
    formats.sizes = {{640, 480}, {160, 120}, {320, 240}, {1280, 720}, {1280, 960}, {1920, 1080}};
  }
  return formats;
}

/// One of the supported formats.
struct StreamFormat {
  Encoding encoding = Encoding::yuyv;
  FrameSize size;
  int rate = 30;
  friend bool operator==(const StreamFormat&, const StreamFormat&) = default;
};

/// Frame interval in units of 100 ns, rounded down as in UVC.
[[nodiscard]] constexpr std::uint32_t interval_of(int rate) { return 10'000'000U / static_cast<std::uint32_t>(rate); }

/// Size of a frame in bytes; for motion JPEG the maximum.
[[nodiscard]] constexpr std::size_t largest_frame(Encoding encoding, FrameSize size) {
  const auto pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  return encoding == Encoding::nv12 ? pixels + pixels / 2 : 2 * pixels;
}

/// pid.codes reserves 1209:0001 to 1209:0010 for tests; the probe uses the first (lightwell/usb_ids.hpp).
inline constexpr std::uint16_t kVendor = 0x1209;
inline constexpr std::uint16_t kProduct = 0x0002;
inline constexpr std::uint16_t kRelease = 0x0100;

inline constexpr std::uint8_t kControlInterface = 0;
inline constexpr std::uint8_t kStreamingInterface = 1;
inline constexpr std::uint8_t kStreamingEndpoint = 0x81;
inline constexpr std::uint16_t kBulkPacket = 512;  ///< The only size that high speed allows.

/// Unit and terminal IDs of the video function.
inline constexpr std::uint8_t kCameraTerminal = 1;
inline constexpr std::uint8_t kProcessingUnit = 2;
inline constexpr std::uint8_t kOutputTerminal = 3;

/// Clock of presentation times and source clocks, in Hz: microseconds, which wrap after 71 minutes (32 bits).
inline constexpr std::uint32_t kClockFrequency = 1'000'000;

struct Identity {
  std::string manufacturer = "Lightwell simulation";  ///< Must differ from a probe's, which a udev rule matches.
  std::string product = "Simulated USB camera";
  std::string serial = "0001";
};

[[nodiscard]] Bytes device_descriptor();
/// Configuration, both interfaces with their class-specific parts, and the endpoint. Format and frame numbers of UVC
/// start at 1 and follow the order in `formats`.
[[nodiscard]] Bytes configuration_descriptor(const SupportedFormats& formats);
/// Device qualifier for full speed: no configuration, because full speed is too slow for a stream.
[[nodiscard]] Bytes device_qualifier();
/// Index 0 is the list of languages. std::nullopt for an unknown index.
[[nodiscard]] std::optional<Bytes> string_descriptor(const Identity& identity, std::uint8_t index);

}  // namespace lightwell::usb_camera
