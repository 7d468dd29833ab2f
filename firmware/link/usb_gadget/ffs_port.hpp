// A GadgetPort on Linux's FunctionFS: the kernel drives the controller, this process implements the interface. Its
// descriptors: linux/usb/functionfs.h; USB 2.0, 9.6; USB 3.2, 9.6.7.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <lightwell/files.hpp>
#include <lightwell/result.hpp>

#include "link/usb_gadget/usb_gadget_link.hpp"

namespace lightwell {

/// One vendor-specific interface with a bulk endpoint in each direction at full, high and super speed, and Microsoft's
/// OS descriptors 1.0: WINUSB as compatible id, so that Windows loads its own driver, and the interface's GUID. The
/// first endpoint (file ep1) sends to the host, the second (ep2) receives; the controller chooses their addresses.
[[nodiscard]] std::vector<std::byte> ffs_descriptors();
/// The string table: the interface's name.
[[nodiscard]] std::vector<std::byte> ffs_strings();

/// The open files of a FunctionFS whose descriptors have been written.
struct FfsFiles {
  FileDescriptor control;  ///< ep0: events are read from it.
  FileDescriptor in;       ///< To the host.
  FileDescriptor out;      ///< From the host.
};

/// Opens ep0 below `mount`, writes descriptors and strings, and opens the endpoint files that the kernel then creates.
/// not_found, failed_precondition, resource_exhausted or unavailable; the message names the file and the remedy.
[[nodiscard]] Result<FfsFiles> open_ffs(const std::string& mount);

/// Transfers use Linux's asynchronous I/O (io_submit), so that one thread waits for control events and both directions.
/// Each GadgetPort::open() calls `open` for the files.
[[nodiscard]] std::unique_ptr<GadgetPort> make_ffs_port(std::function<Result<FfsFiles>()> open);

}  // namespace lightwell
