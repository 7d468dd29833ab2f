#include "camera/backends/replay/timeline.hpp"

#include <gtest/gtest.h>

namespace lightwell::replay {
namespace {

FrameInfo recorded(std::uint64_t sequence, std::int64_t mid_ns) {
  FrameInfo info;
  info.sequence = sequence;
  info.mid_exposure = {mid_ns};
  return info;
}

TEST(ReplayTimeline, KeepsGapsAndIntervals) {
  Timeline timeline({10});
  timeline.start({1000});
  FrameInfo placed = timeline.place(recorded(7, 50));
  EXPECT_EQ(placed.sequence, 7U);
  EXPECT_EQ(placed.mid_exposure.ns, 1000);
  placed = timeline.place(recorded(8, 60));
  EXPECT_EQ(placed.sequence, 8U);
  EXPECT_EQ(placed.mid_exposure.ns, 1010);
  placed = timeline.place(recorded(11, 95));
  EXPECT_EQ(placed.sequence, 11U);
  EXPECT_EQ(placed.mid_exposure.ns, 1045);
}

TEST(ReplayTimeline, ContinuesWhereARecordingWasAppended) {
  Timeline timeline({10});
  timeline.start({1000});
  (void)timeline.place(recorded(7, 50));
  (void)timeline.place(recorded(8, 60));
  const FrameInfo again = timeline.place(recorded(7, 50));
  EXPECT_EQ(again.sequence, 9U);
  EXPECT_EQ(again.mid_exposure.ns, 1020);
  // After a reboot of the probe the recorded clock starts again, while sequence numbers continue.
  const FrameInfo rebooted = timeline.place(recorded(12, 3));
  EXPECT_EQ(rebooted.sequence, 10U);
  EXPECT_EQ(rebooted.mid_exposure.ns, 1030);
}

TEST(ReplayTimeline, SkipsThePauseBetweenTwoRecordings) {
  Timeline timeline({10});
  timeline.start({1000});
  (void)timeline.place(recorded(1, 50));
  const FrameInfo next = timeline.place(recorded(2, 50 + Duration::from_seconds(7200).ns));
  EXPECT_EQ(next.mid_exposure.ns, 1010);
}

TEST(ReplayTimeline, ASecondStartContinuesTimesAndNumbers) {
  Timeline timeline({10});
  timeline.start({1000});
  (void)timeline.place(recorded(7, 50));
  timeline.start({5000});
  const FrameInfo first = timeline.place(recorded(7, 50));
  EXPECT_EQ(first.sequence, 8U);
  EXPECT_EQ(first.mid_exposure.ns, 5000);
}

TEST(ReplayTimeline, ADelayShiftsAllLaterFrames) {
  Timeline timeline({10});
  timeline.start({1000});
  (void)timeline.place(recorded(7, 50));
  timeline.delay({500});
  EXPECT_EQ(timeline.place(recorded(8, 60)).mid_exposure.ns, 1510);
}

TEST(ReplayTimeline, MovedTimesStillIncrease) {
  Timeline timeline({10});
  timeline.start({1000});
  (void)timeline.place(recorded(1, 50));
  EXPECT_EQ(timeline.move_to({2000}).ns, 2000);
  (void)timeline.place(recorded(2, 60));
  EXPECT_EQ(timeline.move_to({1900}).ns, 2001);
}

TEST(ReplayTimeline, AFrameIsReadOutHalfAnExposureAndHalfItsRowsLater) {
  FrameInfo info;
  info.exposure_s = 0.004;
  info.row_readout = {1000};
  EXPECT_EQ(Timeline::until_read_out(info, 480).ns, 2'000'000 + 240'000);
}

}  // namespace
}  // namespace lightwell::replay
