// The memory of a replay: slots that a reader fills, a player lends, and whoever holds a frame
// gives back.
//   free -> (reader fills) -> ready -> (player lends) -> lent -> (holder releases) -> free
#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <vector>

#include <lightwell/time.hpp>

#include "camera/backends/replay/source.hpp"
#include "camera/frame.hpp"

namespace lightwell::replay {

/// Any method from any thread; those that wait return at once after stop().
class FrameSlots final : public FrameOwner {
 public:
  /// At most `lendable` slots are lent at once; `read_ahead` more let the reader go on while all of
  /// them are.
  FrameSlots(int lendable, int read_ahead);

  /// A new run: nothing is ready, nothing has ended; what is lent stays lent.
  void begin();
  void stop();

  static constexpr int kNone = -1;

  // The reader's side.
  /// Waits for a free slot; kNone after stop().
  [[nodiscard]] int wait_free();
  void make_ready(int slot);
  /// No more will be ready.
  void end();

  // The player's side.
  enum class ReadTiming { in_time, late };  ///< late: the player had to wait for the reader.
  struct Ready {
    int slot = kNone;  ///< kNone: at the end, or stopped.
    ReadTiming read_timing = ReadTiming::in_time;
  };
  [[nodiscard]] Ready wait_ready();
  /// False when stopped before `due`.
  [[nodiscard]] bool wait_until(ProbeTime due);
  [[nodiscard]] bool may_lend();
  /// Waits until a slot may be lent; false after stop().
  [[nodiscard]] bool wait_may_lend();
  /// Only where may_lend(), from the one thread that lends.
  [[nodiscard]] Frame lend(int slot);
  /// Back to the free ones unseen.
  void drop(int slot);

  [[nodiscard]] bool stopped();
  /// Belongs to whoever took the slot from wait_free() or wait_ready().
  [[nodiscard]] StoredFrame& frame(int slot) { return frames_[static_cast<std::size_t>(slot)]; }

  void release(int slot) override;

 private:
  std::vector<StoredFrame> frames_;
  int lendable_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // All of capacity frames_.size(), so that nothing is allocated later; ready_ in the order of the
  // recording.
  std::vector<int> free_, ready_;
  int lent_ = 0;
  bool stopped_ = true, ended_ = false;
};

}  // namespace lightwell::replay
