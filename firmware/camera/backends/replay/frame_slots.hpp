// Frame buffers of a replay: a reader fills slots, a player lends them, and consumers release them.
//   free -> (reader fills) -> ready -> (player lends) -> lent -> (holder releases) -> free
#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <vector>

#include <lightwell/time.hpp>

#include "camera/backends/replay/source.hpp"
#include "imaging/frame.hpp"

namespace lightwell::replay {

/// Thread-safe. After stop() waiting methods return at once.
class FrameSlots final : public FrameOwner {
 public:
  /// At most `lendable` slots are lent at the same time; with `read_ahead` more the reader can continue meanwhile.
  FrameSlots(int lendable, int read_ahead);

  /// Begins a new run without ready slots. Lent slots stay lent.
  void begin();
  void stop();

  static constexpr int kNone = -1;

  // The reader's side.
  /// Waits for a free slot; kNone after stop().
  [[nodiscard]] int wait_free();
  void make_ready(int slot);
  /// No more slots will become ready in this run.
  void end();

  // The player's side.
  enum class ReadTiming { in_time, late };  ///< late: the player had to wait for the reader.
  struct Ready {
    int slot = kNone;  ///< kNone: at the end, or stopped.
    ReadTiming read_timing = ReadTiming::in_time;
  };
  [[nodiscard]] Ready wait_ready();
  /// Waits until `due`; false if stopped before.
  [[nodiscard]] bool wait_until(ProbeTime due);
  [[nodiscard]] bool may_lend();
  /// Waits until a slot may be lent; false after stop().
  [[nodiscard]] bool wait_may_lend();
  /// Requires may_lend(). Called by the one thread that lends.
  [[nodiscard]] Frame lend(int slot);
  /// Frees a slot without lending it.
  void drop(int slot);

  [[nodiscard]] bool stopped();
  /// May be accessed by the thread that got `slot` from wait_free() or wait_ready().
  [[nodiscard]] StoredFrame& frame(int slot) { return frames_[static_cast<std::size_t>(slot)]; }

  void release(int slot) override;

 private:
  std::vector<StoredFrame> frames_;
  int lendable_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // Capacity frames_.size(), so that nothing is allocated later; ready_ is in the order of the recording.
  std::vector<int> free_, ready_;
  int lent_ = 0;
  bool stopped_ = true, ended_ = false;
};

}  // namespace lightwell::replay
