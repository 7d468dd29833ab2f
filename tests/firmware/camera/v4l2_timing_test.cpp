// Tests of mid-exposure times, timestamps, sequence numbers and latency.
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "camera/backends/v4l2/timing.hpp"

namespace lightwell::v4l2 {
namespace {

constexpr std::uint32_t kSoe = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
constexpr std::uint32_t kEof = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
constexpr Duration kSecond{1'000'000'000};
constexpr std::int64_t kMs = 1'000'000;

TEST(MidExposure, OfAGlobalShutterIsHalfAnExposureFromStartAndEnd) {
  const RowTiming rows{480, 239.5, {}};
  EXPECT_EQ(mid_exposure({{100 * kMs}, Timestamp::Event::start_of_exposure}, 0.008, rows).ns, 104 * kMs);
  EXPECT_EQ(mid_exposure({{100 * kMs}, Timestamp::Event::end_of_frame}, 0.008, rows).ns, 96 * kMs);
}

TEST(MidExposure, OfARollingShutterIsThatOfTheCentreRow) {
  // 480 rows of 50 us: the first begins at 100 ms, row 240 12 ms later; readout ends after 480 rows.
  const RowTiming rows{480, 240, {50'000}};
  EXPECT_EQ(mid_exposure({{100 * kMs}, Timestamp::Event::start_of_exposure}, 0.008, rows).ns, 116 * kMs);
  EXPECT_EQ(mid_exposure({{132 * kMs}, Timestamp::Event::end_of_frame}, 0.008, rows).ns, 116 * kMs)
      << "the same frame by its end: 100 + 8 + 24 ms";
}

TEST(MidExposure, OfARowFurtherDownIsLater) {
  const auto of_row = [](double row) {
    return mid_exposure({{0}, Timestamp::Event::start_of_exposure}, 0.001, {480, row, {1000}}).ns;
  };
  EXPECT_EQ(of_row(240.5) - of_row(239.5), 1000);
}

TEST(ValidateTimestamp, ReturnsTheEventOfTheTimestamp) {
  EXPECT_EQ(validate_timestamp(kSoe, {90}, {100}, kSecond).event, Timestamp::Event::start_of_exposure);
  EXPECT_EQ(validate_timestamp(kEof, {90}, {100}, kSecond).event, Timestamp::Event::end_of_frame);
  EXPECT_EQ(validate_timestamp(kSoe, {90}, {100}, kSecond).at.ns, 90);
}

TEST(ValidateTimestamp, OfAnotherClockIsReplacedByTheArrival) {
  for (const int flags : {V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, V4L2_BUF_FLAG_TIMESTAMP_COPY,
                          V4L2_BUF_FLAG_TIMESTAMP_COPY | V4L2_BUF_FLAG_TSTAMP_SRC_SOE}) {
    const Timestamp stamp = validate_timestamp(static_cast<std::uint32_t>(flags), {90}, {100}, kSecond);
    EXPECT_EQ(stamp.at.ns, 100);
    EXPECT_EQ(stamp.event, Timestamp::Event::end_of_frame);
  }
}

TEST(ValidateTimestamp, InTheFutureOrLongAgoIsReplacedByTheArrival) {
  EXPECT_EQ(validate_timestamp(kSoe, {101}, {100}, kSecond).at.ns, 100);
  EXPECT_EQ(validate_timestamp(kSoe, {0}, {kSecond.ns}, kSecond).event, Timestamp::Event::start_of_exposure)
      << "just below the limit";
  EXPECT_EQ(validate_timestamp(kSoe, {0}, {kSecond.ns + 1}, kSecond).event, Timestamp::Event::end_of_frame);
}

TEST(SequenceCounter, GapsOfTheDriverAreGaps) {
  SequenceCounter counter;
  EXPECT_EQ(counter.number(0), 0U);
  EXPECT_EQ(counter.number(1), 1U);
  EXPECT_EQ(counter.number(5), 5U);
}

TEST(SequenceCounter, ContinuesWhenTheDriversCounterRestarts) {
  SequenceCounter counter;
  (void)counter.number(700);
  EXPECT_EQ(counter.number(701), 1U) << "the first number of the driver is ignored";
  counter.restart();
  EXPECT_EQ(counter.number(0), 2U);
  counter.restart(30);
  EXPECT_EQ(counter.number(4), 33U) << "thirty frames were lost meanwhile";
}

TEST(SequenceCounter, HandlesThe32BitOverflow) {
  SequenceCounter counter;
  (void)counter.number(0xFFFF'FFFE);
  EXPECT_EQ(counter.number(0xFFFF'FFFF), 1U);
  EXPECT_EQ(counter.number(1), 3U);
}

TEST(SequenceCounter, IncreasesIfTheDriverDoesNotCount) {
  SequenceCounter counter;
  EXPECT_EQ(counter.number(0), 0U);
  EXPECT_EQ(counter.number(0), 1U);
  EXPECT_EQ(counter.number(0), 2U);
  (void)counter.number(9);
  EXPECT_EQ(counter.number(3), 12U) << "a decrease is not a loss";
}

TEST(LatencyMonitor, AThirdOfAFrameBeyondTheMinimumIsTooLate) {
  LatencyMonitor monitor;
  const Duration frame{30 * kMs};
  EXPECT_TRUE(monitor.in_time(0, {40 * kMs}, frame)) << "the first frame defines the minimum";
  EXPECT_TRUE(monitor.in_time(0, {35 * kMs}, frame));
  EXPECT_TRUE(monitor.in_time(0, {45 * kMs}, frame));
  EXPECT_FALSE(monitor.in_time(0, {45 * kMs + 1}, frame));
}

TEST(LatencyMonitor, EachIndexOfTheCycleHasItsOwnMinimum) {
  LatencyMonitor monitor;
  const Duration frame{30 * kMs};
  EXPECT_TRUE(monitor.in_time(0, {5 * kMs}, frame));
  EXPECT_TRUE(monitor.in_time(1, {25 * kMs}, frame)) << "a long exposure with a timestamp of its start";
}

TEST(LatencyMonitor, AdaptsToAnIncreasedLatency) {
  LatencyMonitor monitor;
  const Duration frame{30 * kMs};
  EXPECT_TRUE(monitor.in_time(0, {5 * kMs}, frame));
  int late = 0;
  for (int i = 0; i < 300; ++i)
    if (!monitor.in_time(0, {20 * kMs}, frame)) ++late;
  EXPECT_GE(late, 63);
  EXPECT_LE(late, 128);
}

}  // namespace
}  // namespace lightwell::v4l2
