// A simulated USB cable: the probe's GadgetPort at one end, the host's UsbTransport at the other. Tests unplug, reset,
// stall and damage it. It counts the outcome of every transfer.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <random>
#include <vector>

#include "core/usb_transport.hpp"
#include "link/usb_gadget/usb_gadget_link.hpp"

namespace lightwell::test {

/// Outcomes of the transfers in one direction; each transfer is one frame.
struct Carried {
  std::uint64_t begun = 0;
  std::uint64_t whole = 0;                                         ///< Arrived unchanged.
  std::uint64_t dropped = 0;                                       ///< In flight when the stream broke.
  std::uint64_t damaged = 0;                                       ///< Arrived with flipped bits or a piece missing.
  std::uint64_t descriptors_dropped = 0, descriptors_damaged = 0;  ///< Descriptors among these.
};

class UsbCable {
 public:
  explicit UsbCable(std::uint32_t seed) : random_(seed) {}

  /// The probe's and the host's end; the cable must outlive both.
  [[nodiscard]] std::unique_ptr<GadgetPort> probe_end();
  [[nodiscard]] std::unique_ptr<core::UsbTransport> host_end();

  void plug_in();
  void pull_out();
  /// Resets the device, as a hub does: the probe is configured again, and the host must reopen it.
  void reset();
  /// Stalls the host's next transfer in that direction, once.
  void stall_to_host();
  void stall_to_probe();
  void suspend();
  void resume();
  /// Damages this many of a thousand transfers in each direction, at random.
  void damage(unsigned per_mille);

  [[nodiscard]] Carried to_host() const;
  [[nodiscard]] Carried to_probe() const;
  /// Number of times that the host opened the probe.
  [[nodiscard]] std::uint64_t opened() const;

 private:
  class ProbeEnd;
  class HostEnd;
  /// Number of transfers that the libusb transport keeps in flight.
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

  std::span<const std::byte> sending_;  ///< The probe's transfer in flight.
  bool probe_sends_ = false;
  std::span<std::byte> receiving_;
  bool probe_receives_ = false;
  std::deque<PortEvent> probe_events_;

  std::deque<std::vector<std::byte>> arrived_transfers_;  ///< Completed at the host and not yet read.
  std::vector<std::byte> requested_;                      ///< The host's transfer in flight.
  bool host_sends_ = false;
  std::deque<core::UsbEvent> host_events_;

  Carried to_host_, to_probe_;
  std::uint64_t opened_ = 0;
};

}  // namespace lightwell::test
