// The camera's plug: USB over a socket, as QEMU's usb-redir device speaks it (usbredir protocol 0.7). This side is the
// protocol's usb-host, which has the device; QEMU is its usb-guest.
#pragma once

#include <cstdint>
#include <memory>

#include "usb_camera/device.hpp"
#include "usb_camera/sockets.hpp"

struct usbredirparser;

namespace lightwell::usb_camera {

/// One connection. Nothing here blocks; the owner waits for the socket and calls read() and write().
class RedirPort final : public TransferSink {
 public:
  /// The device outlives the port. `plugged`: it is reported to the host as soon as the host has said hello.
  RedirPort(Device& device, FileDescriptor socket, bool plugged);
  RedirPort(const RedirPort&) = delete;
  RedirPort& operator=(const RedirPort&) = delete;
  ~RedirPort();

  /// Takes in some of what has come. False where the other side has gone, or speaks something else.
  [[nodiscard]] bool read();
  /// Sends what is ready, as far as the socket takes it. False as above.
  [[nodiscard]] bool write();
  [[nodiscard]] bool wants_write() const;
  /// False while a host asks for more than it fetches: then its requests have to wait.
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
  std::size_t may_read_ = 0;  ///< Bytes that are left of one read().
  bool plugged_, greeted_ = false, announced_ = false;
  std::unique_ptr<usbredirparser, Destroy> parser_;
};

}  // namespace lightwell::usb_camera
