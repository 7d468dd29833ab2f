// A USB cable in memory: the probe's GadgetPort at one end, the host's UsbTransport at the other, and a hand that
// pulls, resets, stalls and damages. It knows of every transfer what became of it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <random>
#include <vector>

#include "core/usb_transport.hpp"
#include "link/usb_gadget/gadget_port.hpp"

namespace lightwell::test {

/// What became of the transfers in one direction, each one frame.
struct Carried {
  std::uint64_t begun = 0;
  std::uint64_t whole = 0;                                         ///< Reached the other end as they were.
  std::uint64_t dropped = 0;                                       ///< In flight when the stream broke.
  std::uint64_t damaged = 0;                                       ///< Reached it with bits flipped or a piece missing.
  std::uint64_t descriptors_dropped = 0, descriptors_damaged = 0;  ///< Of these.
};

class UsbCable {
 public:
  explicit UsbCable(std::uint32_t seed) : random_(seed) {}

  /// The probe's end and the host's; each lives no longer than the cable.
  [[nodiscard]] std::unique_ptr<GadgetPort> probe_end();
  [[nodiscard]] std::unique_ptr<core::UsbTransport> host_end();

  void plug_in();
  void pull_out();
  /// As a hub does: the probe is configured anew, and whoever has it open must open it again.
  void reset();
  /// The host's next transfer of that direction is refused, once.
  void stall_to_host();
  void stall_to_probe();
  void suspend();
  void resume();
  /// So many of a thousand transfers are damaged, in each direction.
  void damage(unsigned per_mille);

  [[nodiscard]] Carried to_host() const;
  [[nodiscard]] Carried to_probe() const;
  /// How often the host opened the probe.
  [[nodiscard]] std::uint64_t opened() const;

 private:
  class ProbeEnd;
  class HostEnd;
  /// What libusb keeps in flight.
  static constexpr std::size_t kInFlight = 4;

  void break_stream();
  void pump();
  void enabled();
  [[nodiscard]] bool harmed(std::vector<std::byte>& bytes);
  static void drop(Carried& carried, std::span<const std::byte> bytes);

  mutable std::mutex mutex_;
  std::condition_variable probe_changed_, host_changed_;
  std::mt19937 random_;
  unsigned damage_per_mille_ = 0;

  bool plugged_ = false, announced_ = false, configured_ = false, asleep_ = false, open_ = false, gone_ = false;
  bool arrived_ = false, probe_woken_ = false, host_woken_ = false;
  bool stall_to_host_ = false, stall_to_probe_ = false;

  std::span<const std::byte> sending_;  ///< The probe's transfer under way.
  bool probe_sends_ = false;
  std::span<std::byte> receiving_;
  bool probe_receives_ = false;
  std::deque<PortEvent> probe_events_;

  std::deque<std::vector<std::byte>> arrived_transfers_;  ///< Ended at the host, and not yet looked at.
  std::vector<std::byte> requested_;                      ///< The host's transfer under way.
  bool host_sends_ = false;
  std::deque<core::UsbEvent> host_events_;

  Carried to_host_, to_probe_;
  std::uint64_t opened_ = 0;
};

}  // namespace lightwell::test
