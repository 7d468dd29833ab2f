// Tests of ReportedCycle and HeldCycle.
#include "camera/bracket_cycle.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace lightwell {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

const std::vector<double> kThree{0.001, 0.004, 0.016};

TEST(ReportedCycle, DerivesTheIndexFromTheRoundedReportedExposure) {
  ReportedCycle cycle(kThree);
  const std::vector<double> in_force{0.00102, 0.00398, 0.0158, 0.00099};
  for (std::size_t i = 0; i < in_force.size(); ++i) {
    const auto place = cycle.place(7 + i, in_force[i]);
    ASSERT_TRUE(place);
    EXPECT_EQ(place->index, static_cast<int>(i % 3));
    EXPECT_EQ(place->sequence, i) << "the first frame is number 0";
  }
}

TEST(ReportedCycle, RefusesAnExposureOutsideTheCycle) {
  ReportedCycle cycle(kThree);
  for (const double e : {0.002, 0.0, -0.001, kNaN, std::numeric_limits<double>::infinity()})
    EXPECT_FALSE(cycle.place(1, e)) << e;
}

TEST(ReportedCycle, AFrameWithThePreviousExposureLeavesAGapInTheSequence) {
  // The camera was late by one frame: 1, 1, 4 ms.
  ReportedCycle cycle(kThree);
  const auto first = cycle.place(0, 0.001), again = cycle.place(1, 0.001), next = cycle.place(2, 0.004);
  ASSERT_TRUE(first && again && next);
  EXPECT_EQ(again->index, 0);
  EXPECT_EQ(again->sequence, first->sequence + 2) << "consecutive sequence numbers need consecutive exposures";
  EXPECT_EQ(next->index, 1);
  EXPECT_EQ(next->sequence, again->sequence + 1);
}

TEST(ReportedCycle, LostFramesRemainGaps) {
  ReportedCycle cycle(kThree);
  ASSERT_TRUE(cycle.place(10, 0.001));
  const auto later = cycle.place(15, 0.016);
  ASSERT_TRUE(later);
  EXPECT_EQ(later->sequence, 5U);
  EXPECT_EQ(later->index, 2);
}

TEST(ReportedCycle, ARepeatedExposureIsResolvedByTheOrder) {
  ReportedCycle cycle(std::vector<double>{0.001, 0.001, 0.008});
  const std::vector<double> in_force{0.001, 0.001, 0.008, 0.001, 0.001, 0.008};
  for (std::size_t i = 0; i < in_force.size(); ++i)
    EXPECT_EQ(cycle.place(i, in_force[i])->index, static_cast<int>(i % 3));
}

TEST(ReportedCycle, SynchronisesWhenStartedInsideTheCycle) {
  ReportedCycle cycle(std::vector<double>{0.001, 0.001, 0.008});
  // The second of two equal exposures is assumed to be the first, until the long one resolves the ambiguity.
  EXPECT_EQ(cycle.place(0, 0.001)->index, 0);
  const auto found = cycle.place(1, 0.008);
  EXPECT_EQ(found->index, 2);
  EXPECT_EQ(found->sequence, 2U);
  EXPECT_EQ(cycle.place(2, 0.001)->index, 0);
  EXPECT_EQ(cycle.place(3, 0.001)->index, 1);
}

TEST(ReportedCycle, EqualExposuresAreNumberedInOrder) {
  ReportedCycle cycle(std::vector<double>{0.005, 0.005});
  for (int i = 0; i < 6; ++i) EXPECT_EQ(cycle.place(static_cast<std::uint64_t>(i), 0.005)->index, i % 2);
}

TEST(ReportedCycle, RefusesSequenceNumbersThatDoNotIncrease) {
  ReportedCycle cycle(kThree);
  ASSERT_TRUE(cycle.place(5, 0.001));
  EXPECT_FALSE(cycle.place(5, 0.004));
  EXPECT_FALSE(cycle.place(4, 0.004));
}

TEST(ReportedCycle, ContinuesWhenTheCamerasCounterRestarts) {
  ReportedCycle cycle(kThree);
  ASSERT_TRUE(cycle.place(100, 0.001));
  ASSERT_TRUE(cycle.place(101, 0.004));
  cycle.restart();
  const auto first = cycle.place(0, 0.001);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->index, 0);
  EXPECT_GT(first->sequence, 2U) << "the exposure of 16 ms was skipped: a gap";
  EXPECT_EQ(cycle.place(1, 0.004)->sequence, first->sequence + 1);
}

TEST(HeldCycle, AcceptsFramesThatBeganAfterTheSettlingTime) {
  HeldCycle cycle(2, {100});
  EXPECT_FALSE(cycle.settled({1'000'000})) << "no exposure has been requested";
  cycle.exposure_requested({1000});
  EXPECT_FALSE(cycle.settled({1099}));
  EXPECT_TRUE(cycle.settled({1100}));
}

TEST(HeldCycle, TheLatestOfSeveralRequestsCounts) {
  HeldCycle cycle(2, {100});
  cycle.exposure_requested({1050});
  cycle.exposure_requested({1000});
  EXPECT_FALSE(cycle.settled({1120}));
  EXPECT_TRUE(cycle.settled({1150}));
}

TEST(HeldCycle, ExposuresAreInOrderAndNumberedConsecutively) {
  HeldCycle cycle(3, {100});
  for (std::uint64_t i = 0; i < 7; ++i) {
    EXPECT_EQ(cycle.index(), static_cast<int>(i % 3));
    cycle.exposure_requested({static_cast<std::int64_t>(1000 * i)});
    const CyclePlace place = cycle.take();
    EXPECT_EQ(place.index, static_cast<int>(i % 3));
    EXPECT_EQ(place.sequence, i);
    EXPECT_FALSE(cycle.settled({1'000'000})) << "the next exposure has not been requested yet";
  }
}

TEST(HeldCycle, ASkippedFrameIsAGapAndItsExposureIsRepeated) {
  HeldCycle cycle(2, {100});
  cycle.exposure_requested({0});
  (void)cycle.take();
  cycle.exposure_requested({1000});
  cycle.skip();
  cycle.skip();
  EXPECT_EQ(cycle.index(), 1);
  EXPECT_EQ(cycle.take().sequence, 3U);
}

TEST(HeldCycle, ASingleExposureIsRequestedOnce) {
  HeldCycle cycle(1, {100});
  cycle.exposure_requested({0});
  (void)cycle.take();
  EXPECT_TRUE(cycle.settled({100}));
  cycle.restart();
  EXPECT_FALSE(cycle.settled({1'000'000})) << "the exposure of a restarted camera is unknown";
}

}  // namespace
}  // namespace lightwell
