// The link by USB cable: a vendor interface with two bulk endpoints that carry frames (proto/README.md, "Frames").
#pragma once

#include <cstdint>
#include <memory>

#include <lightwell/commands.hpp>
#include <lightwell/config.hpp>
#include <lightwell/framing.hpp>

#include "link/link.hpp"
#include "link/usb_gadget/gadget_port.hpp"

namespace lightwell {

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

/// The link on FunctionFS. `commands` must outlive the link and is called from its one thread.
[[nodiscard]] std::unique_ptr<UsbGadgetLink> make_usb_gadget_link(const UsbGadgetConfig& config, Commands& commands);

/// The link on any port. `session`: FrameWriter's session number.
[[nodiscard]] std::unique_ptr<UsbGadgetLink> make_usb_gadget_link(std::unique_ptr<GadgetPort> port,
                                                                  std::uint32_t session, Commands& commands);

}  // namespace lightwell
