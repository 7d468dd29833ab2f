// Recorded sequence numbers and times, moved to the present.
#pragma once

#include <cstdint>

#include <lightwell/time.hpp>

#include "camera/frame.hpp"

namespace lightwell::replay {

/// One timeline lives as long as its backend: numbers and times grow over loops and starts. Used by
/// one thread.
class Timeline {
 public:
  /// `interval`: between two frames that are not from one stretch of the recording, as where a loop
  /// begins again.
  explicit Timeline(Duration interval) : interval_(interval) {}

  /// The next frame placed begins at `start`.
  void start(ProbeTime start);
  /// sequence and mid_exposure of the next recorded frame, in the order of the recording.
  [[nodiscard]] FrameInfo place(const FrameInfo& recorded);
  /// The frame just placed, and all after it, come later.
  void delay(Duration by) { last_placed_.mid_exposure = last_placed_.mid_exposure + by; }
  /// Sets the mid-exposure time of the frame just placed, later than all before.
  [[nodiscard]] ProbeTime move_to(ProbeTime mid_exposure);

  [[nodiscard]] Duration interval() const { return interval_; }
  /// When a camera could have handed the frame over: at the end of the last row's exposure.
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
