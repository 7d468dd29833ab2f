#include "e2e/usb_cable.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <utility>

namespace lightwell::test {
namespace {

using core::UsbEvent;

/// Offset of the type in a frame's header.
constexpr std::size_t kKindAt = 5;

bool is_descriptor(std::span<const std::byte> frame) {
  return frame.size() > kKindAt && frame[kKindAt] == std::byte{1};
}

}  // namespace

class UsbCable::ProbeEnd final : public GadgetPort {
 public:
  explicit ProbeEnd(UsbCable& cable) : cable_(cable) {}
  ~ProbeEnd() override { close(); }

  Status open() override {
    const std::lock_guard lock(cable_.mutex_);
    cable_.announced_ = true;
    if (cable_.plugged_) cable_.enabled();
    return {};
  }
  void close() override {
    const std::lock_guard lock(cable_.mutex_);
    if (!cable_.announced_) return;
    cable_.break_stream();
    cable_.announced_ = false;
    cable_.probe_events_.clear();
  }
  bool begin_send(std::span<const std::byte> bytes) override {
    const std::lock_guard lock(cable_.mutex_);
    // GadgetPort guarantees one transfer at a time, on which the counts rely.
    if (cable_.probe_sends_) std::abort();
    ++cable_.to_host_.begun;
    if (!cable_.configured_) {
      drop(cable_.to_host_, bytes);
      return false;
    }
    cable_.sending_ = bytes;
    cable_.probe_sends_ = true;
    cable_.pump();
    return true;
  }
  bool begin_receive(std::span<std::byte> bytes) override {
    const std::lock_guard lock(cable_.mutex_);
    if (!cable_.configured_) return false;
    cable_.receiving_ = bytes;
    cable_.probe_receives_ = true;
    cable_.pump();
    return true;
  }
  PortEvent wait(Duration timeout) override {
    std::unique_lock lock(cable_.mutex_);
    cable_.probe_changed_.wait_for(lock, std::chrono::nanoseconds(timeout.ns),
                                   [&] { return !cable_.probe_events_.empty() || cable_.probe_woken_; });
    if (!cable_.probe_events_.empty()) {
      const PortEvent event = cable_.probe_events_.front();
      cable_.probe_events_.pop_front();
      return event;
    }
    return {std::exchange(cable_.probe_woken_, false) ? PortEvent::Kind::woken : PortEvent::Kind::timeout};
  }
  void wake() override {
    const std::lock_guard lock(cable_.mutex_);
    cable_.probe_woken_ = true;
    cable_.probe_changed_.notify_all();
  }

 private:
  UsbCable& cable_;
};

class UsbCable::HostEnd final : public core::UsbTransport {
 public:
  explicit HostEnd(UsbCable& cable) : cable_(cable) {}

  Status open(const std::string&) override {
    const std::lock_guard lock(cable_.mutex_);
    if (!cable_.configured_) return {StatusCode::not_found, "no probe is plugged in"};
    // Setting the interface begins a new stream.
    cable_.break_stream();
    cable_.enabled();
    cable_.open_ = true;
    ++cable_.opened_;
    return {};
  }
  void close() override {
    const std::lock_guard lock(cable_.mutex_);
    for (const auto& bytes : cable_.arrived_transfers_) drop(cable_.to_host_, bytes);
    cable_.arrived_transfers_.clear();
    cable_.host_events_.clear();
    if (std::exchange(cable_.host_sends_, false)) ++cable_.to_probe_.dropped;
    cable_.open_ = cable_.gone_ = false;
  }
  Status begin_send(std::span<const std::byte> bytes) override {
    const std::lock_guard lock(cable_.mutex_);
    ++cable_.to_probe_.begun;
    if (!cable_.open_ || cable_.gone_) {
      ++cable_.to_probe_.dropped;
      return {StatusCode::unavailable, "the probe is gone"};
    }
    cable_.requested_.assign(bytes.begin(), bytes.end());
    cable_.host_sends_ = true;
    cable_.pump();
    return {};
  }
  UsbEvent wait(Duration timeout) override {
    std::unique_lock lock(cable_.mutex_);
    cable_.host_changed_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] {
      return !cable_.arrived_transfers_.empty() || !cable_.host_events_.empty() || cable_.gone_ || cable_.arrived_ ||
             cable_.host_woken_;
    });
    if (!cable_.host_events_.empty()) {
      UsbEvent event = cable_.host_events_.front();
      cable_.host_events_.pop_front();
      return event;
    }
    if (!cable_.arrived_transfers_.empty()) {
      read_ = std::move(cable_.arrived_transfers_.front());
      cable_.arrived_transfers_.pop_front();
      const bool descriptor = is_descriptor(read_);
      if (cable_.harmed(read_)) {
        ++cable_.to_host_.damaged;
        if (descriptor) ++cable_.to_host_.descriptors_damaged;
      } else {
        ++cable_.to_host_.whole;
      }
      cable_.pump();
      return {UsbEvent::Kind::received, read_, UsbEvent::TransferEnd::of_transfer, {}};
    }
    if (std::exchange(cable_.gone_, false)) {
      // A probe that was plugged in again in the meantime counts as another device.
      cable_.open_ = false;
      return {UsbEvent::Kind::gone, {}, {}, "the probe is gone"};
    }
    if (std::exchange(cable_.arrived_, false)) return {UsbEvent::Kind::arrived, {}, {}, {}};
    return {std::exchange(cable_.host_woken_, false) ? UsbEvent::Kind::woken : UsbEvent::Kind::timeout, {}, {}, {}};
  }
  void wake() override {
    const std::lock_guard lock(cable_.mutex_);
    cable_.host_woken_ = true;
    cable_.host_changed_.notify_all();
  }

 private:
  UsbCable& cable_;
  std::vector<std::byte> read_;
};

std::unique_ptr<GadgetPort> UsbCable::probe_end() { return std::make_unique<ProbeEnd>(*this); }
std::unique_ptr<core::UsbTransport> UsbCable::host_end() { return std::make_unique<HostEnd>(*this); }

void UsbCable::plug_in() {
  const std::lock_guard lock(mutex_);
  if (plugged_) return;
  plugged_ = true;
  if (announced_) enabled();
}

void UsbCable::pull_out() {
  const std::lock_guard lock(mutex_);
  plugged_ = false;
  break_stream();
}

void UsbCable::reset() {
  const std::lock_guard lock(mutex_);
  if (!configured_) return;
  break_stream();
  enabled();
}

void UsbCable::stall_to_host() {
  const std::lock_guard lock(mutex_);
  stall_to_host_ = true;
  pump();
}

void UsbCable::stall_to_probe() {
  const std::lock_guard lock(mutex_);
  stall_to_probe_ = true;
}

void UsbCable::suspend() {
  const std::lock_guard lock(mutex_);
  if (!configured_ || asleep_) return;
  asleep_ = true;
  probe_events_.push_back({PortEvent::Kind::suspended});
  probe_changed_.notify_all();
}

void UsbCable::resume() {
  const std::lock_guard lock(mutex_);
  if (!std::exchange(asleep_, false)) return;
  probe_events_.push_back({PortEvent::Kind::resumed});
  probe_changed_.notify_all();
  pump();
}

void UsbCable::damage(unsigned per_mille) {
  const std::lock_guard lock(mutex_);
  damage_per_mille_ = per_mille;
}

Carried UsbCable::to_host() const {
  const std::lock_guard lock(mutex_);
  return to_host_;
}
Carried UsbCable::to_probe() const {
  const std::lock_guard lock(mutex_);
  return to_probe_;
}
std::uint64_t UsbCable::opened() const {
  const std::lock_guard lock(mutex_);
  return opened_;
}

/// Ends transfers in flight with errors. The host can still read what had arrived before it sees the error.
void UsbCable::break_stream() {
  if (std::exchange(probe_sends_, false)) {
    drop(to_host_, sending_);
    probe_events_.push_back({PortEvent::Kind::sent, 0, ESHUTDOWN});
  }
  if (std::exchange(probe_receives_, false)) probe_events_.push_back({PortEvent::Kind::received, 0, ESHUTDOWN});
  if (std::exchange(host_sends_, false)) ++to_probe_.dropped;
  if (configured_) probe_events_.push_back({PortEvent::Kind::disabled});
  configured_ = asleep_ = false;
  stall_to_host_ = stall_to_probe_ = false;
  if (open_) gone_ = true;
  probe_changed_.notify_all();
  host_changed_.notify_all();
}

void UsbCable::enabled() {
  configured_ = true;
  gone_ = gone_ && open_;
  arrived_ = true;
  probe_events_.push_back({PortEvent::Kind::enabled});
  probe_changed_.notify_all();
  host_changed_.notify_all();
}

/// Completes all transfers that can be completed.
void UsbCable::pump() {
  if (!open_ || !configured_ || gone_ || asleep_) return;
  if (std::exchange(stall_to_host_, false)) {
    host_events_.push_back({UsbEvent::Kind::failed, {}, {}, "the probe stalled its endpoint; it was cleared"});
    host_changed_.notify_all();
  }
  if (probe_sends_ && arrived_transfers_.size() < kInFlight) {
    probe_sends_ = false;
    arrived_transfers_.emplace_back(sending_.begin(), sending_.end());
    probe_events_.push_back({PortEvent::Kind::sent, sending_.size(), 0});
    probe_changed_.notify_all();
    host_changed_.notify_all();
  }
  if (host_sends_ && stall_to_probe_) {
    host_sends_ = stall_to_probe_ = false;
    ++to_probe_.dropped;
    host_events_.push_back({UsbEvent::Kind::sent, {}, {}, "the probe refused a transfer"});
    host_changed_.notify_all();
  }
  if (host_sends_ && probe_receives_) {
    host_sends_ = probe_receives_ = false;
    ++(harmed(requested_) ? to_probe_.damaged : to_probe_.whole);
    std::copy(requested_.begin(), requested_.end(), receiving_.begin());
    probe_events_.push_back({PortEvent::Kind::received, requested_.size(), 0});
    host_events_.push_back({UsbEvent::Kind::sent, {}, {}, {}});
    probe_changed_.notify_all();
    host_changed_.notify_all();
  }
}

/// Flips some bits or removes a piece at random; false if the bytes are unchanged.
bool UsbCable::harmed(std::vector<std::byte>& bytes) {
  if (bytes.size() < 2 || random_() % 1000 >= damage_per_mille_) return false;
  // A zero byte that may follow the frame does not belong to it.
  const std::size_t at = random_() % (bytes.size() - 1);
  if (random_() % 2 == 0) {
    bytes[at] ^= static_cast<std::byte>(1U << random_() % 8);
  } else {
    const std::size_t length = 1 + random_() % (bytes.size() - 1 - at);
    bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                bytes.begin() + static_cast<std::ptrdiff_t>(at + length));
  }
  return true;
}

void UsbCable::drop(Carried& carried, std::span<const std::byte> bytes) {
  ++carried.dropped;
  if (is_descriptor(bytes)) ++carried.descriptors_dropped;
}

}  // namespace lightwell::test
