// A GadgetPort on Linux's FunctionFS: the kernel drives the controller, this process implements the interface.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <lightwell/result.hpp>

#include "link/usb_gadget/gadget_port.hpp"

namespace lightwell {

/// A file descriptor that is closed with its owner.
class OwnedFile {
 public:
  OwnedFile() = default;
  explicit OwnedFile(int fd) : fd_(fd) {}
  OwnedFile(OwnedFile&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  OwnedFile& operator=(OwnedFile&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~OwnedFile();
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_ = -1;
};

/// The open files of a FunctionFS whose descriptors have been written.
struct FfsFiles {
  OwnedFile control;  ///< ep0: events are read from it.
  OwnedFile in;       ///< To the host.
  OwnedFile out;      ///< From the host.
};

/// Opens ep0 below `mount`, writes descriptors and strings, and opens the endpoint files that the kernel then creates.
/// not_found, failed_precondition, resource_exhausted or unavailable; the message names the file and the remedy.
[[nodiscard]] Result<FfsFiles> open_ffs(const std::string& mount);

/// Transfers use Linux's asynchronous I/O (io_submit), so that one thread waits for control events and both directions.
/// Each GadgetPort::open() calls `open` for the files.
[[nodiscard]] std::unique_ptr<GadgetPort> make_ffs_port(std::function<Result<FfsFiles>()> open);

}  // namespace lightwell
