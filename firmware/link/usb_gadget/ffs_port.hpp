// A GadgetPort by Linux's FunctionFS: the kernel drives the controller, this process owns the interface.
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

/// The files of a FunctionFS whose descriptors are written.
struct FfsFiles {
  OwnedFile control;  ///< ep0: events come from it.
  OwnedFile in;       ///< To the host.
  OwnedFile out;      ///< From the host.
};

/// Opens ep0 below `mount`, writes descriptors and strings, opens the endpoints' files that the kernel then makes.
/// not_found, resource_exhausted: what is wrong with the mount and what to do.
[[nodiscard]] Result<FfsFiles> open_ffs(const std::string& mount);

/// Transfers are Linux's asynchronous I/O (io_submit), so that one thread waits for events and both directions. `open`:
/// the files, at each GadgetPort::open().
[[nodiscard]] std::unique_ptr<GadgetPort> make_ffs_port(std::function<Result<FfsFiles>()> open);

}  // namespace lightwell
