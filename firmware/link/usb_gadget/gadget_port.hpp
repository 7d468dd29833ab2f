// Interface to a USB gadget, independent of the controller's driver.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

struct PortEvent {
  enum class Kind : std::uint8_t {
    timeout,
    woken,      ///< By wake().
    enabled,    ///< A host configured the gadget, perhaps again: a new byte stream begins in each direction.
    disabled,   ///< Unplugged, reset, or in another configuration.
    suspended,  ///< The bus is suspended; transfers wait.
    resumed,
    sent,      ///< A transfer to the host ended.
    received,  ///< A transfer from the host ended.
  };
  Kind kind = Kind::timeout;
  std::size_t bytes = 0;  ///< Length of a transfer.
  int error = 0;          ///< Of a transfer: errno; 0 if it succeeded.
};

/// One interface with a bulk endpoint in each direction. All functions but wake() are called from one thread. At most
/// one transfer per direction is in progress. Each ends with an event, with an error if the host disconnects; until
/// then the port owns its memory.
class GadgetPort {
 public:
  virtual ~GadgetPort() = default;

  /// Announces the interface; a host can see it from now on.
  [[nodiscard]] virtual Status open() = 0;
  /// Withdraws the interface. Cancels transfers in progress; they have no event.
  virtual void close() = 0;

  /// False if the transfer could not begin: the endpoint is not enabled, or the system lacks resources.
  [[nodiscard]] virtual bool begin_send(std::span<const std::byte> bytes) = 0;
  [[nodiscard]] virtual bool begin_receive(std::span<std::byte> bytes) = 0;

  /// The next event; the order of events is kept within each direction.
  [[nodiscard]] virtual PortEvent wait(Duration timeout) = 0;
  /// Ends the current or the next wait(). Any thread.
  virtual void wake() = 0;
};

}  // namespace lightwell
