// Lock-free exchange of the newest value between one writer and many readers.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <utility>

namespace lightwell::core {

/// Holds the newest shared value. One thread publishes, any number of threads read. A reader retries only if the writer
/// published between two of its instructions, so it never waits for the writer. With more slots than readers that are
/// suspended inside read(), the writer does not wait either.
///
/// Proof that a reader never copies a pointer while the writer changes it. The writer changes a slot only after (W1)
/// its own earlier store moved `latest_` away from the slot, and then (W2) it loaded a pin count of zero. A reader (R1)
/// increments the pin count, then (R2) loads `latest_` again and copies only if that is still the slot. All four are
/// sequentially consistent, so they have a single order:
///   - R1 before W2: the writer sees the pin and uses another slot, until the reader unpins (release) and the writer
///     sees that (acquire): the copy happens before the change.
///   - W2 before R1: then W1 is before R2, and R2 can load the slot's index only from the store that the writer made
///     after its change: the change happens before the copy.
/// std::atomic<std::shared_ptr> has the same semantics, but uses a spin lock internally, on which a reader would wait
/// for a suspended writer.
template <class T, std::size_t kSlots = 8>
class LatestStore {
  static_assert(kSlots >= 2, "one to read, one to write");

 public:
  /// Null before the first publish(). Any thread.
  [[nodiscard]] std::shared_ptr<const T> read() const {
    for (;;) {
      const std::size_t index = latest_.load(std::memory_order_seq_cst);
      const Slot& slot = slots_[index];
      slot.pins.fetch_add(1, std::memory_order_seq_cst);
      if (latest_.load(std::memory_order_seq_cst) == index) {
        std::shared_ptr<const T> copy = slot.held;
        slot.pins.fetch_sub(1, std::memory_order_release);
        return copy;
      }
      slot.pins.fetch_sub(1, std::memory_order_release);
    }
  }

  /// The writer's thread only. Pins last for nanoseconds: it waits only if every other slot is pinned by a reader that
  /// is suspended inside read().
  void publish(std::shared_ptr<const T> value) {
    const std::size_t current = latest_.load(std::memory_order_relaxed);
    for (std::size_t step = 1;; ++step) {
      const std::size_t index = (current + step) % kSlots;
      if (index == current) {
        std::this_thread::yield();
        continue;
      }
      Slot& slot = slots_[index];
      if (slot.pins.load(std::memory_order_seq_cst) != 0) continue;
      slot.held = std::move(value);
      latest_.store(index, std::memory_order_seq_cst);
      return;
    }
  }

 private:
  struct Slot {
    mutable std::atomic<std::uint32_t> pins{0};
    std::shared_ptr<const T> held;
  };
  std::array<Slot, kSlots> slots_;
  std::atomic<std::size_t> latest_{0};
};

}  // namespace lightwell::core
