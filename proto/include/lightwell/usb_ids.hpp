// USB identification of a probe. Single definition for the gadget, the host, the udev rule and the script that builds
// the gadget.
#pragma once

#include <cstdint>

namespace lightwell {

/// 1209:0001, the test PID of pid.codes, which may be used by anyone but not in products: Lightwell has no PID of its
/// own yet, and the vendor 1d6b (Linux Foundation) is used by gadgets of many boards. Because others test with this
/// number as well, the interface below is also checked.
inline constexpr std::uint16_t kUsbVendor = 0x1209;
inline constexpr std::uint16_t kUsbProduct = 0x0001;

/// Manufacturer string, by which the udev rule distinguishes a probe from other devices with that number.
inline constexpr char kUsbManufacturer[] = "Lightwell";

/// The single interface, with two bulk endpoints: vendor-specific class, with a subclass and a protocol that others are
/// unlikely to use. The host opens only an interface with these three values.
inline constexpr std::uint8_t kUsbInterfaceClass = 0xFF;
inline constexpr std::uint8_t kUsbInterfaceSubclass = 0x4C;
inline constexpr std::uint8_t kUsbInterfaceProtocol = 0x57;

/// Device interface GUID under which Windows registers the interface (libusb looks for it).
inline constexpr char kUsbInterfaceGuid[] = "{6B0A4D1E-93C5-4E0F-9E57-2C8F4B7A61D3}";

}  // namespace lightwell
