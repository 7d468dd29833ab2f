// How a probe is known on USB. The one place: the gadget, the host, the udev rule and the script that builds the gadget
// take these numbers from here.
#pragma once

#include <cstdint>

namespace lightwell {

/// pid.codes' 1209:0001, a number that anyone may use for tests and nobody may sell: Lightwell has no number of its own
/// yet, and 1d6b belongs to the Linux Foundation's own gadgets, which other probes and boards carry too. Others test
/// with this number as well, so that it never decides alone: see the interface below.
inline constexpr std::uint16_t kUsbVendor = 0x1209;
inline constexpr std::uint16_t kUsbProduct = 0x0001;

/// The manufacturer's string, by which the udev rule tells a probe from other devices of that number.
inline constexpr char kUsbManufacturer[] = "Lightwell";

/// Of the one interface with two bulk endpoints: vendor-specific, with a subclass and a protocol that others are
/// unlikely to have. The host takes an interface of these three alone.
inline constexpr std::uint8_t kUsbInterfaceClass = 0xFF;
inline constexpr std::uint8_t kUsbInterfaceSubclass = 0x4C;
inline constexpr std::uint8_t kUsbInterfaceProtocol = 0x57;

/// What Windows registers the interface under, for programs that look for it (libusb does).
inline constexpr char kUsbInterfaceGuid[] = "{6B0A4D1E-93C5-4E0F-9E57-2C8F4B7A61D3}";

}  // namespace lightwell
