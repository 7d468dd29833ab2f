// The link by USB cable: a vendor interface with two bulk endpoints that carry frames (proto/README.md, "Frames").
#pragma once

#include <cstdint>
#include <memory>

#include <lightwell/config.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/status.hpp>

#include "link/link.hpp"
#include "link/usb_gadget/gadget_port.hpp"

namespace lightwell {

/// What a gadget did since it was made.
struct UsbGadgetCounters {
  FrameCounters from_host;
  std::uint64_t invalid_requests = 0;       ///< Intact frames from the host that held nothing that a host may send.
  std::uint64_t requests = 0;           ///< Answered.
  std::uint64_t responses_dropped = 0;  ///< Answers that a host which asks without reading did not get.
  std::uint64_t frames_begun = 0;       ///< Handed to the controller: the number of the last frame.
  std::uint64_t frames_failed = 0;      ///< Of these, ended with an error: in flight when the cable was pulled.
  std::uint64_t descriptors_begun = 0;  ///< Of frames_begun.
  std::uint64_t descriptors_without_listener = 0;            ///< Descriptors published while no host was listening.
};

/// A Link with its own counters.
class UsbGadgetLink : public Link {
 public:
  /// Any thread.
  [[nodiscard]] virtual UsbGadgetCounters usb_counters() const = 0;
};

/// A host listens while it asks: descriptors are sent to one whose last request came within this time. So none wait in
/// the controller for a host that has no use for them, to be its first and oldest news later.
inline constexpr Duration kListenerTimeout{10'000'000'000};

/// By FunctionFS. `commands` must outlive the link and is called from its one thread.
[[nodiscard]] std::unique_ptr<UsbGadgetLink> make_usb_gadget_link(const UsbGadgetConfig& config, Commands& commands);

/// By any port; session: FrameWriter's.
[[nodiscard]] std::unique_ptr<UsbGadgetLink> make_usb_gadget_link(std::unique_ptr<GadgetPort> port,
                                                                  std::uint32_t session, Commands& commands);

}  // namespace lightwell
