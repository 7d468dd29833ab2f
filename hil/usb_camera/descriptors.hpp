// The descriptors by which a host knows the camera: USB 2.0, chapter 9, and the USB Video Class 1.1 (USB Device Class
// Definition for Video Devices, revision 1.1; section numbers below are its own).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "usb_camera/little_endian.hpp"
#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

/// pid.codes' numbers 1209:0001 to 0010 are for tests; the first is the probe's (lightwell/usb_ids.hpp).
inline constexpr std::uint16_t kVendor = 0x1209;
inline constexpr std::uint16_t kProduct = 0x0002;
inline constexpr std::uint16_t kRelease = 0x0100;

inline constexpr std::uint8_t kControlInterface = 0;
inline constexpr std::uint8_t kStreamingInterface = 1;
inline constexpr std::uint8_t kStreamingEndpoint = 0x81;
inline constexpr std::uint16_t kBulkPacket = 512;  ///< The only size that high speed allows.

/// The units of the video function and their numbers.
inline constexpr std::uint8_t kCameraTerminal = 1;
inline constexpr std::uint8_t kProcessingUnit = 2;
inline constexpr std::uint8_t kOutputTerminal = 3;

/// Of presentation times and source clocks: they count microseconds, and 32 bits of them wrap after 71 minutes.
inline constexpr std::uint32_t kClockFrequency = 1'000'000;

struct Identity {
  std::string manufacturer = "Lightwell simulation";  ///< None of a probe's, whose udev rule looks at it.
  std::string product = "Simulated USB camera";
  std::string serial = "0001";
};

[[nodiscard]] Bytes device_descriptor();
/// Configuration, both interfaces with their class-specific parts, and the endpoint. Format and frame numbers of UVC
/// start at 1 and follow the offer's order.
[[nodiscard]] Bytes configuration_descriptor(const SupportedFormats& offer);
/// What the device would be at full speed: it would have no configuration, as no stream fits there.
[[nodiscard]] Bytes device_qualifier();
/// Index 0 is the list of languages. Nothing for a number that no descriptor names.
[[nodiscard]] std::optional<Bytes> string_descriptor(const Identity& identity, std::uint8_t index);

}  // namespace lightwell::usb_camera
