// Interface of a USB connection to a probe: libusb, or a simulated cable in tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell::core {

/// An event of a transport.
struct UsbEvent {
  enum class Kind : std::uint8_t {
    timeout,
    woken,     ///< wake() was called.
    arrived,   ///< A probe was plugged in: open() may succeed now.
    received,  ///< Bytes were received.
    sent,      ///< The transfer to the probe ended, with or without an error.
    failed,    ///< A transfer failed; the connection continues.
    gone,      ///< The connection is lost: close(), then open() again.
  };
  enum class TransferEnd : std::uint8_t { of_transfer, none };

  Kind kind = Kind::timeout;
  std::span<const std::byte> bytes;                     ///< For `received`; valid until the next wait().
  TransferEnd transfer_end = TransferEnd::of_transfer;  ///< none: the transfer continues with the next bytes.
  std::string error;                                    ///< For `failed`, `gone`, and `sent` with an error.
};

/// One interface with two bulk endpoints (in and out), of one probe at a time. Everything but wake() is for one thread.
/// Reading starts with open().
class UsbTransport {
 public:
  virtual ~UsbTransport() = default;

  /// Opens the probe with this serial number; empty: the only probe on USB. not_found: there is none.
  /// failed_precondition: there are several, or this user has no permission. resource_exhausted: another program uses
  /// it. unavailable: it was unplugged meanwhile.
  [[nodiscard]] virtual Status open(const std::string& serial) = 0;
  /// Closes the connection within a second; no events of it follow.
  virtual void close() = 0;

  /// Starts a transfer to the probe, one at a time; the bytes are copied. unavailable if it cannot be started.
  [[nodiscard]] virtual Status begin_send(std::span<const std::byte> bytes) = 0;

  /// The next event. May return early with `timeout`.
  [[nodiscard]] virtual UsbEvent wait(Duration timeout) = 0;
  /// Ends the current or the next wait(). Any thread.
  virtual void wake() = 0;
};

/// Serial numbers of the probes on USB that this user may open. The errors of make_libusb_transport();
/// failed_precondition if there are probes but this user may open none of them.
[[nodiscard]] Result<std::vector<std::string>> probes_on_usb();

/// Transport with libusb. unavailable if libusb cannot be initialised; failed_precondition if the SDK was built without
/// it.
[[nodiscard]] Result<std::unique_ptr<UsbTransport>> make_libusb_transport();

}  // namespace lightwell::core
