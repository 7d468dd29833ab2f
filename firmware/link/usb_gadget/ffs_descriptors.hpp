// The USB descriptors of the interface as bytes for FunctionFS (linux/usb/functionfs.h; USB 2.0, 9.6; USB 3.2, 9.6.7).
#pragma once

#include <cstddef>
#include <vector>

namespace lightwell {

/// One vendor-specific interface with a bulk endpoint in each direction at full, high and super speed, and Microsoft's
/// OS descriptors 1.0: WINUSB as compatible id, so that Windows loads its own driver, and the interface's GUID. The
/// first endpoint (file ep1) sends to the host, the second (ep2) receives; the controller chooses their addresses.
[[nodiscard]] std::vector<std::byte> ffs_descriptors();

/// The string table for FunctionFS: the interface's name.
[[nodiscard]] std::vector<std::byte> ffs_strings();

}  // namespace lightwell
