// The newest value of one writer for many readers, without a lock.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <utility>

namespace lightwell::core {

/// Holds the newest shared value. One thread publishes, any number read. A reader repeats only when
/// the writer published between two of its instructions, so it never waits for the writer. More
/// slots than readers that may sleep inside read() keep the writer from waiting, too.
///
/// Why a reader never copies a pointer that the writer changes. The writer changes a slot only
/// after it saw, in this order, (W1) `latest_` moved away from the slot by its own earlier store,
/// and (W2) no pin on it. A reader (R1) pins, then (R2) reads `latest_` again and copies only if
/// that still names the slot. All four are sequentially consistent, so they have one order:
///   - R1 before W2: the writer sees the pin and takes another slot, until the reader unpins
///   (release)
///     and the writer sees it (acquire): the copy happens before the change.
///   - W2 before R1: then W1 is before R2, and R2 can name the slot only if it reads the store that
///     the writer made after its change was complete: the change happens before the copy.
/// std::atomic<std::shared_ptr> would do the same, but takes a spin lock inside, on which a reader
/// would wait for a writer that was put to sleep.
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

  /// The writer's thread. Pins last for nanoseconds, so it waits only where as many readers as
  /// there are slots were put to sleep inside read() at the same time.
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
