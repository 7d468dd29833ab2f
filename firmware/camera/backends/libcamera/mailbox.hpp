// Queue of events for a backend's thread: requests that libcamera has completed, released frames, connected and
// disconnected cameras. Bounded by the number of buffers; no allocation after prepare().
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <vector>

#include "camera/backends/libcamera/sensor_clock.hpp"

namespace lightwell::libcam {

struct Completion {
  int lens = 0;
  int session = 0;  ///< Lens::session() of the request; completions of older sessions are ignored.
  int buffer = 0;
  ClockReading at;
};

class Mailbox {
 public:
  struct Events {
    std::vector<Completion> completions;
    std::vector<int> returned;
    bool cameras_changed = false;
    bool stop = false;
  };

  /// Reserves capacity, here and in `post`, which must be the argument of every take(). Call before any other thread
  /// uses the mailbox.
  void prepare(Events& post, std::size_t completions, std::size_t returns);

  // Thread-safe.
  void complete(const Completion& completion);
  void give_back(int slot);
  void cameras_changed();
  void stop();

  // Called by the backend's thread.
  using Clock = std::chrono::steady_clock;
  /// Waits until there are events, or until `limit`; replaces `post` by them, in order.
  void take(Events& post, Clock::time_point limit);
  /// Discards completions and a pending stop; released frames stay until take().
  void restart();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  Events filling_;
  std::size_t max_completions_ = 0;
};

}  // namespace lightwell::libcam
