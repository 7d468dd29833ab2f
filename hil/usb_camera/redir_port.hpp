// USB over a socket by the usbredir protocol 0.7, which QEMU's usb-redir device implements. This side is the protocol's
// usb-host, which has the device; QEMU is its usb-guest.
#pragma once

#include <cstdint>
#include <memory>

#include <lightwell/file_descriptor.hpp>

#include "usb_camera/device.hpp"

struct usbredirparser;

namespace lightwell::usb_camera {

/// One connection. No function blocks; the owner polls the socket and calls read() and write().
class RedirPort final : public TransferSink {
 public:
  /// `device` must outlive the port. `plugged`: the device is reported to the host after the host's hello packet.
  RedirPort(Device& device, FileDescriptor socket, bool plugged);
  RedirPort(const RedirPort&) = delete;
  RedirPort& operator=(const RedirPort&) = delete;
  ~RedirPort();

  /// Processes part of the received data. False: the connection is closed or the protocol is violated.
  [[nodiscard]] bool read();
  /// Sends pending data as far as the socket accepts it. False as for read().
  [[nodiscard]] bool write();
  [[nodiscard]] bool wants_write() const;
  /// False while too much data is pending, because the host requests more than it reads: its requests then have to
  /// wait.
  [[nodiscard]] bool wants_read() const;
  [[nodiscard]] int socket() const { return socket_.get(); }

  void plug();
  void unplug();

  void complete(std::uint64_t id, TransferStatus status, std::span<const std::uint8_t> data) override;

 private:
  struct Callbacks;
  struct Destroy {
    void operator()(usbredirparser* parser) const;
  };
  void announce();
  void describe();

  Device& device_;
  FileDescriptor socket_;
  std::size_t may_read_ = 0;  ///< Remaining bytes of the current read().
  bool plugged_, greeted_ = false, announced_ = false;
  std::unique_ptr<usbredirparser, Destroy> parser_;
};

}  // namespace lightwell::usb_camera
