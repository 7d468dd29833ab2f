// What this machine can do: checks that need no probe.
#pragma once

#include <string>
#include <vector>

#include <lightwell/time.hpp>

#include "doctor/check.hpp"

namespace lightwell::tool {

/// The SDK's version, and the links that it was built with.
[[nodiscard]] Finding check_sdk();

/// The shared library that applications in C, Python and C# load, against this SDK's header: LW_ABI_VERSION. `library`
/// is a path, or a name that the system's loader searches. It is loaded in a child process, because its protobuf and
/// this program's must not meet.
[[nodiscard]] Finding check_library(const std::string& library);

/// The wall clock, by which certificates expire: plausible, and synchronised (adjtimex). Lightwell's times of light do
/// not depend on it.
[[nodiscard]] Finding check_wall_clock();

/// Network interfaces that are up and have an address.
[[nodiscard]] Finding check_network();

/// Probes announced on the network, and whether avahi-daemon runs.
[[nodiscard]] Finding check_mdns(Duration timeout);

/// Where Linux shows USB devices, and udev its rules.
struct UsbPaths {
  std::string devices = "/sys/bus/usb/devices";
  std::string nodes = "/dev/bus/usb";
  std::string udev = "/run/udev";
  std::vector<std::string> rules = {"/etc/udev/rules.d", "/run/udev/rules.d", "/usr/local/lib/udev/rules.d",
                                    "/usr/lib/udev/rules.d", "/lib/udev/rules.d"};
};

/// Probes that are plugged in, by their numbers (usb_ids.hpp), and whether this user may open their device files.
[[nodiscard]] Finding check_usb_devices(const UsbPaths& paths = {});

/// The udev rule that gives this user the device files.
[[nodiscard]] Finding check_usb_rule(const UsbPaths& paths = {});

/// The store of `lightwell pair`: no other user may read it, and its certificates are valid now, for another month.
/// not_checked without a paired probe, and in a build without TLS.
[[nodiscard]] Finding check_credential_store(const std::string& store);

}  // namespace lightwell::tool
