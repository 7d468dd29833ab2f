#include "camera/backends/replay/timeline.hpp"

#include <algorithm>

namespace lightwell::replay {
namespace {

/// A longer pause separates two recordings in one file, and is not replayed.
constexpr Duration kMaxPause = Duration::from_seconds(3600);

/// Whether `next` continues the run of `last`; false at the start of a loop and where a recording was appended to.
bool follows(const FrameInfo& next, const FrameInfo& last) {
  return next.sequence > last.sequence && next.mid_exposure > last.mid_exposure &&
         next.mid_exposure - last.mid_exposure <= kMaxPause;
}

}  // namespace

void Timeline::start(ProbeTime start) {
  start_ = start;
  if (next_ == Next::on) next_ = Next::first_of_start;
}

FrameInfo Timeline::place(const FrameInfo& recorded) {
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

ProbeTime Timeline::move_to(ProbeTime mid_exposure) {
  last_placed_.mid_exposure = std::max(mid_exposure, before_ + Duration{1});
  return last_placed_.mid_exposure;
}

Duration Timeline::until_read_out(const FrameInfo& frame, int height) {
  return Duration::from_seconds(frame.exposure_s / 2) + Duration{frame.row_readout.ns * height / 2};
}

}  // namespace lightwell::replay
