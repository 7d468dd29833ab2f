// A probe on USB by umockdev, for the unmodified libusb: what the kernel's usbfs would do, without a kernel's help.
//
// The program runs with LD_PRELOAD=libumockdev-preload.so.0 (CMakeLists.txt), which leads /sys, udev's events, open()
// and ioctl() here. The node is a regular file, which poll() always reports as ready, so libusb polls instead of
// sleeping; timing cannot be tested here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace lightwell::test {

/// Properties of the device.
struct UsbDeviceKind {
  std::string serial = "LW-1";
  std::uint8_t in = 0x81, out = 0x02;  ///< Endpoints.
  std::uint8_t interface_subclass = 0x4C;
  /// Number of interfaces before the probe's, for example of a network function.
  int interfaces_before = 0;
};

/// A device in one of two ports, plugged in at construction. Responds to requests as a probe does.
class UmockProbe {
 public:
  explicit UmockProbe(const UsbDeviceKind& kind = {}, int port = 1);
  ~UmockProbe();
  UmockProbe(const UmockProbe&) = delete;
  UmockProbe& operator=(const UmockProbe&) = delete;

  void unplug();
  void plug_in();

  /// Sends a descriptor in a frame, as one transfer.
  void send(const std::string& descriptor);
  /// Sends the bytes unchanged, as one transfer.
  void send_bytes(std::vector<std::byte> bytes);
  /// The next transfer to the host ends with this status of a URB, -EPIPE for a stall.
  void fail_next(int status);
  enum class Answering { yes, no };
  void set_answering(Answering answering);

  [[nodiscard]] int halts_cleared() const;
  [[nodiscard]] int interfaces_set() const;
  [[nodiscard]] int requests() const;

 private:
  struct Port;
  Port& port_;
};

}  // namespace lightwell::test
