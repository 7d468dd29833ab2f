// Maps recorded sequence numbers and times to those of the replay.
#pragma once

#include <cstdint>

#include <lightwell/time.hpp>

#include "imaging/frame.hpp"

namespace lightwell::replay {

/// Lives as long as its backend: sequence numbers and times increase over loops and starts. Not thread-safe.
class Timeline {
 public:
  /// `interval`: frame interval used where recorded times are not continuous, for instance at the start of a loop.
  explicit Timeline(Duration interval) : interval_(interval) {}

  /// The mid-exposure time of the next frame is `start`.
  void start(ProbeTime start);
  /// Sequence and mid-exposure time of the next frame. Frames are passed in the order of the recording.
  [[nodiscard]] FrameInfo place(const FrameInfo& recorded);
  /// Delays the last placed frame and all later ones.
  void delay(Duration by) { last_placed_.mid_exposure = last_placed_.mid_exposure + by; }
  /// Sets the mid-exposure time of the last placed frame, or a later time if needed to stay after all previous frames.
  [[nodiscard]] ProbeTime move_to(ProbeTime mid_exposure);

  [[nodiscard]] Duration interval() const { return interval_; }
  /// Time from mid-exposure to the end of the last row's exposure: the earliest delivery by a live camera.
  [[nodiscard]] static Duration until_read_out(const FrameInfo& frame, int height);

 private:
  enum class Next { first_of_all, first_of_start, on };
  Duration interval_;
  Next next_ = Next::first_of_all;
  ProbeTime start_;
  FrameInfo last_recorded_, last_placed_;
  ProbeTime before_{-1};
};

}  // namespace lightwell::replay
