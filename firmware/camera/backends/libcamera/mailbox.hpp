// What reaches a backend's thread from others: requests that libcamera has completed, frames that are given back,
// cameras that come and go. Bounded by the number of buffers; nothing is allocated once it is prepared.
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
  int session = 0;  ///< Which acquisition of the camera; those of older ones are void.
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

  /// Room for so many completions and returned frames at once, here and in `post`, the only one for take(). Before
  /// anybody else comes.
  void prepare(Events& post, std::size_t completions, std::size_t returns);

  // From any thread.
  void complete(const Completion& completion);
  void give_back(int slot);
  void cameras_changed();
  void stop();

  // From the thread that reads.
  using Clock = std::chrono::steady_clock;
  /// Waits until there is something, or until `limit`; `post` is what came meanwhile, in its order.
  void take(Events& post, Clock::time_point limit);
  /// Completions are void and a stop is forgotten; frames given back stay until they are taken.
  void restart();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  Events filling_;
  std::size_t max_completions_ = 0;
};

}  // namespace lightwell::libcam
