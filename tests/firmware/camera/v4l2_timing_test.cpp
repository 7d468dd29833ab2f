// From a driver's stamp to the middle of the centre row's exposure, and from its numbers to ours.
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "camera/backends/v4l2/timing.hpp"

namespace lightwell::v4l2 {
namespace {

constexpr std::uint32_t kSoe = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
constexpr std::uint32_t kEof = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
constexpr Duration kSecond{1'000'000'000};
constexpr std::int64_t kMs = 1'000'000;

TEST(MidExposure, OfAGlobalShutterIsHalfAnExposureFromEitherEnd) {
  const RowTiming rows{480, 239.5, {}};
  EXPECT_EQ(mid_exposure({{100 * kMs}, Timestamp::Event::start_of_exposure}, 0.008, rows).ns, 104 * kMs);
  EXPECT_EQ(mid_exposure({{100 * kMs}, Timestamp::Event::end_of_frame}, 0.008, rows).ns, 96 * kMs);
}

TEST(MidExposure, OfARollingShutterIsTheCentreRows) {
  // 480 rows of 50 us: the first begins at 100 ms, row 240 12 ms later; the last has been read out after 480 of them.
  const RowTiming rows{480, 240, {50'000}};
  EXPECT_EQ(mid_exposure({{100 * kMs}, Timestamp::Event::start_of_exposure}, 0.008, rows).ns, 116 * kMs);
  EXPECT_EQ(mid_exposure({{132 * kMs}, Timestamp::Event::end_of_frame}, 0.008, rows).ns, 116 * kMs)
      << "the same frame by its other end: 100 + 8 + 24 ms";
}

TEST(MidExposure, OfARowFurtherDownIsLater) {
  const auto of_row = [](double row) {
    return mid_exposure({{0}, Timestamp::Event::start_of_exposure}, 0.001, {480, row, {1000}}).ns;
  };
  EXPECT_EQ(of_row(240.5) - of_row(239.5), 1000);
}

TEST(TrustedStamp, SaysWhichEndOfTheExposureItIs) {
  EXPECT_EQ(validate_timestamp(kSoe, {90}, {100}, kSecond).event, Timestamp::Event::start_of_exposure);
  EXPECT_EQ(validate_timestamp(kEof, {90}, {100}, kSecond).event, Timestamp::Event::end_of_frame);
  EXPECT_EQ(validate_timestamp(kSoe, {90}, {100}, kSecond).at.ns, 90);
}

TEST(TrustedStamp, OfAnotherClockIsReplacedByTheArrival) {
  for (const int flags : {V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, V4L2_BUF_FLAG_TIMESTAMP_COPY,
                          V4L2_BUF_FLAG_TIMESTAMP_COPY | V4L2_BUF_FLAG_TSTAMP_SRC_SOE}) {
    const Timestamp stamp = validate_timestamp(static_cast<std::uint32_t>(flags), {90}, {100}, kSecond);
    EXPECT_EQ(stamp.at.ns, 100);
    EXPECT_EQ(stamp.event, Timestamp::Event::end_of_frame);
  }
}

TEST(TrustedStamp, InTheFutureOrLongAgoIsReplacedByTheArrival) {
  EXPECT_EQ(validate_timestamp(kSoe, {101}, {100}, kSecond).at.ns, 100);
  EXPECT_EQ(validate_timestamp(kSoe, {0}, {kSecond.ns}, kSecond).event, Timestamp::Event::start_of_exposure)
      << "just not too old";
  EXPECT_EQ(validate_timestamp(kSoe, {0}, {kSecond.ns + 1}, kSecond).event, Timestamp::Event::end_of_frame);
}

TEST(SequenceCounter, GapsOfTheDriverAreGaps) {
  SequenceCounter counter;
  EXPECT_EQ(counter.number(0), 0U);
  EXPECT_EQ(counter.number(1), 1U);
  EXPECT_EQ(counter.number(5), 5U);
}

TEST(SequenceCounter, GoesOnWhereTheDriverCountsAnew) {
  SequenceCounter counter;
  (void)counter.number(700);
  EXPECT_EQ(counter.number(701), 1U) << "what it begins with says nothing";
  counter.restart();
  EXPECT_EQ(counter.number(0), 2U);
  counter.restart(30);
  EXPECT_EQ(counter.number(4), 33U) << "thirty were lost while it was away";
}

TEST(SequenceCounter, GoesOverTheEndOf32Bits) {
  SequenceCounter counter;
  (void)counter.number(0xFFFF'FFFE);
  EXPECT_EQ(counter.number(0xFFFF'FFFF), 1U);
  EXPECT_EQ(counter.number(1), 3U);
}

TEST(SequenceCounter, ADriverThatDoesNotCountIsCountedFor) {
  SequenceCounter counter;
  EXPECT_EQ(counter.number(0), 0U);
  EXPECT_EQ(counter.number(0), 1U);
  EXPECT_EQ(counter.number(0), 2U);
  (void)counter.number(9);
  EXPECT_EQ(counter.number(3), 12U) << "nor is going back a loss";
}

TEST(LatencyMonitor, AThirdOfAFrameBeyondTheLeastIsTooLate) {
  LatencyMonitor punctuality;
  const Duration frame{30 * kMs};
  EXPECT_TRUE(punctuality.in_time(0, {40 * kMs}, frame)) << "the first is all there is to go by";
  EXPECT_TRUE(punctuality.in_time(0, {35 * kMs}, frame));
  EXPECT_TRUE(punctuality.in_time(0, {45 * kMs}, frame));
  EXPECT_FALSE(punctuality.in_time(0, {45 * kMs + 1}, frame));
}

TEST(LatencyMonitor, EachPlaceOfTheCycleHasItsOwnLeast) {
  LatencyMonitor punctuality;
  const Duration frame{30 * kMs};
  EXPECT_TRUE(punctuality.in_time(0, {5 * kMs}, frame));
  EXPECT_TRUE(punctuality.in_time(1, {25 * kMs}, frame)) << "a long exposure, stamped at its start";
}

TEST(LatencyMonitor, ACameraWhoseLatencyHasGrownIsForgivenInTime) {
  LatencyMonitor punctuality;
  const Duration frame{30 * kMs};
  EXPECT_TRUE(punctuality.in_time(0, {5 * kMs}, frame));
  int late = 0;
  for (int i = 0; i < 300; ++i)
    if (!punctuality.in_time(0, {20 * kMs}, frame)) ++late;
  EXPECT_GE(late, 63);
  EXPECT_LE(late, 128);
}

}  // namespace
}  // namespace lightwell::v4l2
