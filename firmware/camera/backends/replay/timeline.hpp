// Maps recorded sequence numbers and times to those of the replay.
#pragma once

#include <algorithm>

#include <lightwell/time.hpp>

#include "imaging/frame.hpp"

namespace lightwell::replay {

/// Lives as long as its backend: sequence numbers and times increase over loops and starts. Not thread-safe.
class Timeline {
 public:
  /// `interval`: frame interval used where recorded times are not continuous, for instance at the start of a loop.
  explicit Timeline(Duration interval) : interval_(interval) {}

  /// The mid-exposure time of the next frame is `start`.
  void start(ProbeTime start) {
    start_ = start;
    if (next_ == Next::on) next_ = Next::first_of_start;
  }

  /// Sequence and mid-exposure time of the next frame. Frames are passed in the order of the recording.
  [[nodiscard]] FrameInfo place(const FrameInfo& recorded) {
    FrameInfo placed = recorded;
    before_ = next_ == Next::first_of_all ? ProbeTime{-1} : last_placed_.mid_exposure;
    if (next_ == Next::first_of_all) {
      placed.mid_exposure = start_;
    } else if (next_ == Next::first_of_start) {
      placed.sequence = last_placed_.sequence + 1;
      placed.mid_exposure = std::max(start_, last_placed_.mid_exposure + Duration{1});
    } else if (follows(recorded, last_recorded_)) {
      placed.sequence = last_placed_.sequence + (recorded.sequence - last_recorded_.sequence);
      placed.mid_exposure = last_placed_.mid_exposure + (recorded.mid_exposure - last_recorded_.mid_exposure);
    } else {
      placed.sequence = last_placed_.sequence + 1;
      placed.mid_exposure = last_placed_.mid_exposure + interval_;
    }
    next_ = Next::on;
    last_recorded_ = recorded;
    last_placed_ = placed;
    return placed;
  }

  /// Delays the last placed frame and all later ones.
  void delay(Duration by) { last_placed_.mid_exposure = last_placed_.mid_exposure + by; }
  /// Sets the mid-exposure time of the last placed frame, or a later time if needed to stay after all previous frames.
  [[nodiscard]] ProbeTime move_to(ProbeTime mid_exposure) {
    last_placed_.mid_exposure = std::max(mid_exposure, before_ + Duration{1});
    return last_placed_.mid_exposure;
  }

  [[nodiscard]] Duration interval() const { return interval_; }
  /// Time from mid-exposure to the end of the last row's exposure: the earliest delivery by a live camera.
  [[nodiscard]] static Duration until_read_out(const FrameInfo& frame, int height) {
    return Duration::from_seconds(frame.exposure_s / 2) + Duration{frame.row_readout.ns * height / 2};
  }

 private:
  /// A longer pause separates two recordings in one file, and is not replayed.
  static constexpr Duration kMaxPause = Duration::from_seconds(3600);
  /// Whether `next` continues the run of `last`; false at the start of a loop and where a recording was appended to.
  static bool follows(const FrameInfo& next, const FrameInfo& last) {
    return next.sequence > last.sequence && next.mid_exposure > last.mid_exposure &&
           next.mid_exposure - last.mid_exposure <= kMaxPause;
  }

  enum class Next { first_of_all, first_of_start, on };
  Duration interval_;
  Next next_ = Next::first_of_all;
  ProbeTime start_;
  FrameInfo last_recorded_, last_placed_;
  ProbeTime before_{-1};
};

}  // namespace lightwell::replay
