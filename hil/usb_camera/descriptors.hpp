// The camera's USB descriptors: USB 2.0, chapter 9, and the USB Video Class 1.1 (USB Device Class Definition for Video
// Devices, revision 1.1; section numbers below refer to it).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "usb_camera/little_endian.hpp"
#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

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
