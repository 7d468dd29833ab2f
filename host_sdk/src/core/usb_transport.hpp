// What a probe on USB is reached through: libusb, or a cable in memory where a test pulls it ten thousand times.
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

/// What happened at a transport.
struct UsbEvent {
  enum class Kind : std::uint8_t {
    timeout,
    woken,     ///< By wake().
    arrived,   ///< A probe was plugged in: open() may succeed now.
    received,  ///< Bytes came.
    sent,      ///< The transfer to the probe ended, well or not.
    failed,    ///< A transfer failed, and the connection goes on.
    gone,      ///< The connection is over: close(), and open() anew.
  };
  enum class Ending : std::uint8_t { of_transfer, none };

  Kind kind = Kind::timeout;
  std::span<const std::byte> bytes;     ///< Of `received`, until the next wait().
  Ending ending = Ending::of_transfer;  ///< none: the transfer goes on with the next bytes.
  std::string error;                    ///< Of `failed`, `gone` and a `sent` that did not arrive.
};

/// One interface with a bulk endpoint each way, of one probe at a time. All but wake() are of one thread. Bytes are
/// read from open() on, without being asked for.
class UsbTransport {
 public:
  virtual ~UsbTransport() = default;

  /// The probe with this serial number; empty: the only one that is plugged in. not_found: there is none.
  /// failed_precondition: there are several, or this user may not open it. resource_exhausted: another program has it.
  /// unavailable: it went away meanwhile.
  [[nodiscard]] virtual Status open(const std::string& serial) = 0;
  /// No event of the connection comes afterwards. Within a second.
  virtual void close() = 0;

  /// One transfer at a time; the bytes are copied. unavailable where it could not begin.
  [[nodiscard]] virtual Status begin_send(std::span<const std::byte> bytes) = 0;

  /// The next event. May return early with `timeout`.
  [[nodiscard]] virtual UsbEvent wait(Duration timeout) = 0;
  /// Ends a wait(), the present or the next one. Any thread.
  virtual void wake() = 0;
};

/// The serial numbers of the probes that are plugged in and that this user may open. The errors of
/// make_libusb_transport(); failed_precondition where there are probes and none of them may be opened.
[[nodiscard]] Result<std::vector<std::string>> probes_on_usb();

/// By libusb. unavailable where USB cannot be had at all; failed_precondition where the SDK was built without libusb.
[[nodiscard]] Result<std::unique_ptr<UsbTransport>> make_libusb_transport();

}  // namespace lightwell::core
