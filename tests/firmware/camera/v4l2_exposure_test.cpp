// Tests of ExposureSchedule and of the measurement of the control delay.
#include <cmath>

#include <gtest/gtest.h>

#include "camera/backends/v4l2/control_delay.hpp"
#include "camera/backends/v4l2/timing.hpp"

namespace lightwell::v4l2 {
namespace {

using Outcome = ExposureSchedule::Outcome;

/// Feeds frames `first` to `last`, without losses and with all writes in time.
void run(ExposureSchedule& schedule, std::uint64_t first, std::uint64_t last) {
  for (std::uint64_t s = first; s <= last; ++s)
    if (const auto write = schedule.due(s)) schedule.written(*write, Outcome::in_time);
}

TEST(ExposureSchedule, ASingleExposureNeedsNoWrites) {
  const ExposureSchedule schedule(1, 5);
  EXPECT_FALSE(schedule.due(7));
  EXPECT_EQ(schedule.index_of(0), 0);
  EXPECT_EQ(schedule.index_of(12345), 0);
}

TEST(ExposureSchedule, WritesAheadByTheDelay) {
  ExposureSchedule schedule(3, 2);
  const auto write = schedule.due(10);
  ASSERT_TRUE(write);
  EXPECT_EQ(write->from, 12U);
  EXPECT_EQ(write->index, 0) << "12 is a multiple of 3";
  schedule.written(*write, Outcome::in_time);
  EXPECT_FALSE(schedule.due(10)) << "at most one write per frame";
}

TEST(ExposureSchedule, FramesBeforeTheFirstWriteHaveNoIndex) {
  ExposureSchedule schedule(2, 3);
  run(schedule, 0, 6);
  for (std::uint64_t s = 0; s < 3; ++s) EXPECT_FALSE(schedule.index_of(s)) << s;
  for (std::uint64_t s = 3; s < 10; ++s) EXPECT_EQ(schedule.index_of(s), static_cast<int>(s % 2)) << s;
}

TEST(ExposureSchedule, FramesWhoseWriteWasLostHaveNoIndex) {
  ExposureSchedule schedule(3, 2);
  run(schedule, 0, 9);
  // Frame 10 is lost, so nothing was written for frame 12, which has the exposure of frame 11.
  run(schedule, 11, 14);
  EXPECT_EQ(schedule.index_of(11), 2);
  EXPECT_FALSE(schedule.index_of(12));
  EXPECT_EQ(schedule.index_of(13), 1) << "the cycle must stay in step";
  EXPECT_EQ(schedule.index_of(14), 2);
}

TEST(ExposureSchedule, AfterAWholeLostCycleTheNextFrameHasItsIndexByCoincidence) {
  ExposureSchedule schedule(2, 1);
  run(schedule, 0, 4);
  run(schedule, 8, 9);
  // Frame 5 was written; frames 6, 7 and 8 have the same exposure.
  EXPECT_EQ(schedule.index_of(5), 1);
  EXPECT_FALSE(schedule.index_of(6));
  EXPECT_EQ(schedule.index_of(7), 1);
  EXPECT_FALSE(schedule.index_of(8));
  EXPECT_EQ(schedule.index_of(9), 1);
}

TEST(ExposureSchedule, FramesAfterALateWriteHaveNoIndexUntilTheNextWrite) {
  ExposureSchedule schedule(2, 2);
  run(schedule, 0, 5);
  const auto write = schedule.due(6);
  ASSERT_TRUE(write);
  schedule.written(*write, Outcome::uncertain);
  run(schedule, 7, 8);
  EXPECT_EQ(schedule.index_of(7), 1);
  EXPECT_FALSE(schedule.index_of(8));
  EXPECT_EQ(schedule.index_of(9), 1);
}

TEST(ExposureSchedule, RestartDiscardsAllWrites) {
  ExposureSchedule schedule(2, 2);
  run(schedule, 0, 5);
  schedule.restart();
  EXPECT_FALSE(schedule.index_of(6));
  EXPECT_TRUE(schedule.due(5));
}

TEST(ExposureSchedule, WorksWithTheLongestDelayAndLargeNumbers) {
  ExposureSchedule schedule(8, ExposureSchedule::kMaxDelay);
  for (std::uint64_t s = 0; s < 5000; ++s) {
    run(schedule, s, s);
    if (s >= 30) {
      ASSERT_EQ(schedule.index_of(s), static_cast<int>(s % 8)) << s;
    }
  }
}

/// Levels of a camera with the given delay: `low` before a step that is set at frame 10, `high` after it.
std::vector<Level> step(std::uint64_t delay, double low, double high) {
  std::vector<Level> levels;
  for (std::uint64_t s = 5; s < 23; ++s) levels.push_back({s, s < 10 + delay ? low : high});
  return levels;
}

TEST(DelayOfStep, IsTheFirstFrameWithTheNewLevel) {
  for (std::uint64_t delay = 1; delay <= 9; ++delay) {
    EXPECT_EQ(delay_of_step(step(delay, 0.1, 0.6), 10), static_cast<int>(delay));
    EXPECT_EQ(delay_of_step(step(delay, 0.6, 0.1), 10), static_cast<int>(delay)) << "downwards";
  }
}

TEST(DelayOfStep, NoiseDoesNotHideAStepThatIsLarger) {
  std::vector<Level> levels = step(3, 0.1, 0.6);
  for (std::size_t i = 0; i < levels.size(); ++i) levels[i].level += i % 2 == 0 ? 0.02 : -0.02;
  EXPECT_EQ(delay_of_step(levels, 10), 3);
  for (std::size_t i = 0; i < levels.size(); ++i) levels[i].level += i % 2 == 0 ? 0.08 : -0.08;
  EXPECT_FALSE(delay_of_step(levels, 10)) << "variations of 0.2 must hide a step of 0.5";
}

TEST(DelayOfStep, IsEmptyInDarknessAndSaturation) {
  EXPECT_FALSE(delay_of_step(step(3, 0, 0), 10));
  EXPECT_FALSE(delay_of_step(step(3, 1, 1), 10));
  EXPECT_FALSE(delay_of_step(step(3, 0, 0.005), 10));
  EXPECT_FALSE(delay_of_step(step(3, 0.90, 0.95), 10));
  EXPECT_FALSE(delay_of_step(step(3, 0.1, std::nan("")), 10));
}

TEST(DelayOfStep, IsEmptyForGradualAndTransientChanges) {
  std::vector<Level> slow = step(3, 0.1, 0.6);
  slow[8].level = 0.35;  // Frame 13, intermediate level.
  EXPECT_FALSE(delay_of_step(slow, 10));
  std::vector<Level> flash = step(7, 0.1, 0.6);
  flash[7].level = 0.6;  // A lamp was switched on and off.
  EXPECT_FALSE(delay_of_step(flash, 10));
}

TEST(DelayOfStep, IsEmptyIfTheFrameAtTheStepWasLost) {
  std::vector<Level> levels = step(3, 0.1, 0.6);
  levels.erase(levels.begin() + 8);  // Frame 13, the first one with the new level.
  EXPECT_FALSE(delay_of_step(levels, 10));
  levels = step(3, 0.1, 0.6);
  levels.erase(levels.begin() + 7);  // Frame 12: the step may be at 12 or 13.
  EXPECT_FALSE(delay_of_step(levels, 10));
  levels = step(3, 0.1, 0.6);
  levels.erase(levels.begin() + 6);
  EXPECT_EQ(delay_of_step(levels, 10), 3) << "a lost frame elsewhere does not matter";
}

TEST(DelayOfStep, IsEmptyForTooFewFrames) {
  EXPECT_FALSE(delay_of_step({}, 10));
  const std::vector<Level> levels = step(3, 0.1, 0.6);
  EXPECT_FALSE(delay_of_step(levels, 6)) << "only two frames before the step";
  EXPECT_FALSE(delay_of_step(std::span(levels).first(11), 10)) << "only five frames after the step";
}

}  // namespace
}  // namespace lightwell::v4l2
