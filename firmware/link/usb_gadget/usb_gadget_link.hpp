// The link by USB cable: a vendor interface with two bulk endpoints that carry frames (proto/README.md, "Frames").
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <lightwell/commands.hpp>
#include <lightwell/config.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

#include "link/link.hpp"

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

/// A USB gadget, independent of the controller's driver: one interface with a bulk endpoint in each direction. All
/// functions but wake() are called from one thread. At most one transfer per direction is in progress. Each ends with
/// an event, with an error if the host disconnects; until then the port owns its memory.
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

/// Counters since the construction of the link.
struct UsbGadgetCounters {
  FrameCounters from_host;
  std::uint64_t invalid_requests = 0;   ///< Intact frames from the host without a valid request.
  std::uint64_t requests = 0;           ///< Requests answered.
  std::uint64_t responses_dropped = 0;  ///< Responses dropped because the host sends requests without reading.
  std::uint64_t frames_begun = 0;       ///< Frames passed to the controller; equals the last sequence number.
  std::uint64_t frames_failed = 0;      ///< Of frames_begun, those that ended with an error (cable unplugged).
  std::uint64_t descriptors_begun = 0;  ///< Of frames_begun, those with a descriptor.
  std::uint64_t descriptors_without_listener = 0;  ///< Descriptors published while no host was listening.
  std::uint64_t plane_messages_begun = 0;          ///< Of frames_begun, those with a message of a captured plane.
  std::uint64_t planes_replaced = 0;               ///< Updates of a plane that a slow host missed.
  std::uint64_t plane_requests_refused = 0;        ///< Requests of the whole plane within kPlaneRepeat.
};

/// A Link with USB-specific counters.
class UsbGadgetLink : public Link {
 public:
  /// Any thread.
  [[nodiscard]] virtual UsbGadgetCounters usb_counters() const = 0;
};

/// Descriptors are sent only if the host's last request came within this time. Otherwise a descriptor could stay in the
/// controller and reach the next host much later.
inline constexpr Duration kListenerTimeout{10'000'000'000};

/// A host that receives planes can request the whole plane again after this time.
inline constexpr Duration kPlaneRepeat{1'000'000'000};

/// The link on FunctionFS. `commands` must outlive the link and is called from its one thread.
[[nodiscard]] std::unique_ptr<UsbGadgetLink> make_usb_gadget_link(const UsbGadgetConfig& config, Commands& commands);

/// The link on any port. `session`: FrameWriter's session number.
[[nodiscard]] std::unique_ptr<UsbGadgetLink> make_usb_gadget_link(std::unique_ptr<GadgetPort> port,
                                                                  std::uint32_t session, Commands& commands);

}  // namespace lightwell
