// What a USB gadget's life consists of, whoever drives the controller.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

/// What happened at a port.
struct PortEvent {
  enum class Kind : std::uint8_t {
    timeout,
    woken,      ///< By wake().
    enabled,    ///< A host configured the gadget, perhaps once more: a new stream of bytes each way.
    disabled,   ///< It is there no more: unplugged, reset, or configured otherwise.
    suspended,  ///< The bus sleeps. Transfers wait.
    resumed,
    sent,      ///< A transfer to the host ended.
    received,  ///< A transfer from the host ended.
  };
  Kind kind = Kind::timeout;
  std::size_t bytes = 0;  ///< Of a transfer.
  int error = 0;          ///< Of a transfer: errno; 0 where it is whole.
};

/// One interface with a bulk endpoint each way. All but wake() are of one thread. At most one transfer is under way in
/// each direction; one that began ends with its event, when the host is gone with an error, and its memory is the
/// port's until then.
class GadgetPort {
 public:
  virtual ~GadgetPort() = default;

  /// Announces the interface; a host can see it from now on.
  [[nodiscard]] virtual Status open() = 0;
  /// Withdraws it. No transfer is under way afterwards, and none has an event.
  virtual void close() = 0;

  /// False where it could not begin: the endpoint is not enabled (any more), or the system is short of something.
  [[nodiscard]] virtual bool begin_send(std::span<const std::byte> bytes) = 0;
  [[nodiscard]] virtual bool begin_receive(std::span<std::byte> bytes) = 0;

  /// The next event, in the order in which they happened in each direction.
  [[nodiscard]] virtual PortEvent wait(Duration timeout) = 0;
  /// Ends a wait(), the present or the next one. Any thread.
  virtual void wake() = 0;
};

}  // namespace lightwell
