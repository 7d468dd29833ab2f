// A probe on USB by umockdev, for the unmodified libusb: what the kernel's usbfs would do, without a kernel's help.
//
// The program runs with LD_PRELOAD=libumockdev-preload.so.0 (CMakeLists.txt), which leads /sys, udev's events, open()
// and ioctl() here. The node is a regular file, which poll() finds always ready: libusb asks again and again instead of
// sleeping, so that nothing is to be learnt here of waiting and of time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace lightwell::test {

/// What the device says of itself.
struct UsbDeviceKind {
  std::string serial = "LW-1";
  std::uint8_t in = 0x81, out = 0x02;  ///< Endpoints.
  std::uint8_t interface_subclass = 0x4C;
  /// Interfaces before the probe's: of a network function, say.
  int interfaces_before = 0;
};

/// One in one port; two ports there are. Answers requests as a probe does. Made plugged in.
class UmockProbe {
 public:
  explicit UmockProbe(const UsbDeviceKind& kind = {}, int port = 1);
  ~UmockProbe();
  UmockProbe(const UmockProbe&) = delete;
  UmockProbe& operator=(const UmockProbe&) = delete;

  void unplug();
  void plug_in();

  /// A descriptor in a frame, as one transfer.
  void send(const std::string& descriptor);
  /// Bytes as they are, as one transfer.
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
