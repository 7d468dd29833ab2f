// Injected faults: the frames that the host receives, and their entries in the log.
#include <gtest/gtest.h>

#include "hil/usb_camera/stream_bench.hpp"

namespace lightwell::usb_camera {
namespace {

using bench::StreamBench;

class Fault : public ::testing::TestWithParam<Pace> {
 protected:
  Fault() {
    bench_.arm();
    bench_.run(50);
  }
  /// Every frame number appears in the log, in order.
  void expect_numbers_without_gap() {
    std::uint64_t next = 0;
    for (const FrameRecord& r : bench_.log.records()) EXPECT_EQ(r.number, next++);
  }
  [[nodiscard]] std::size_t received() const { return bench_.host.frames.size(); }

  StreamBench bench_{GetParam()};
};

TEST_P(Fault, TornFramesLackTheirMiddle) {
  bench_.stream.faults().tear = 3;
  const std::size_t before = received();
  bench_.run(100);
  ASSERT_EQ(bench_.log.count(Outcome::torn), 3U);
  const auto torn = bench_.with(Outcome::torn);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& got = bench_.host.frames[before + i];
    const std::vector<std::uint8_t> whole = bench_.expected(torn[i]);
    const std::size_t third = whole.size() / 3;
    ASSERT_EQ(got.bytes.size(), 2 * third);
    EXPECT_EQ(torn[i].sent, 2 * third);
    EXPECT_TRUE(std::equal(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(third), got.bytes.begin()));
    EXPECT_TRUE(std::equal(whole.end() - static_cast<std::ptrdiff_t>(third), whole.end(),
                           got.bytes.begin() + static_cast<std::ptrdiff_t>(third)));
    EXPECT_FALSE(got.error) << "the header must not show the fault";
  }
  EXPECT_EQ(bench_.host.frames[before + 3].bytes.size(), bench_.source.bytes());
  expect_numbers_without_gap();
}

TEST_P(Fault, ShortenedFramesLackTheirEnd) {
  bench_.stream.faults().shorten = 2;
  const std::size_t before = received();
  bench_.run(100);
  ASSERT_EQ(bench_.log.count(Outcome::shortened), 2U);
  const std::vector<std::uint8_t> whole = bench_.expected(bench_.with(Outcome::shortened)[0]);
  const auto& got = bench_.host.frames[before].bytes;
  ASSERT_EQ(got.size(), whole.size() - whole.size() / 3);
  EXPECT_TRUE(std::equal(got.begin(), got.end(), whole.begin()));
}

TEST_P(Fault, MarkedFramesAreCompleteWithTheErrorBit) {
  bench_.stream.faults().mark = 2;
  const std::size_t before = received();
  bench_.run(100);
  ASSERT_EQ(bench_.log.count(Outcome::marked), 2U);
  EXPECT_TRUE(bench_.host.frames[before].error);
  EXPECT_TRUE(bench_.host.frames[before + 1].error);
  EXPECT_FALSE(bench_.host.frames[before + 2].error);
  EXPECT_EQ(bench_.host.frames[before].bytes, bench_.expected(bench_.with(Outcome::marked)[0]));
}

TEST_P(Fault, SkippedFramesAreMissing) {
  bench_.stream.faults().skip = 4;
  const std::size_t before = received();
  bench_.run(100);
  EXPECT_EQ(bench_.log.count(Outcome::skipped), 4U);
  EXPECT_NEAR(static_cast<double>(received() - before), 6, 1);
  expect_numbers_without_gap();
}

TEST_P(Fault, ASilentCameraAcceptsTransfersAndSendsNothing) {
  bench_.stream.faults().silent_until = bench_.now + Duration{300 * bench::kMs};
  const std::size_t before = received();
  bench_.run(299);
  EXPECT_LE(received() - before, 1U) << "at most the frame that was being sent";
  EXPECT_NEAR(static_cast<double>(bench_.log.count(Outcome::silent)), 30, 2);
  EXPECT_EQ(bench_.host.count(TransferStatus::stalled), 0);
  bench_.run(100);
  EXPECT_GT(received() - before, 7U);
  expect_numbers_without_gap();
}

TEST_P(Fault, AHaltStallsUntilItIsCleared) {
  bench_.stream.halt(bench_.host);
  const std::size_t before = received();
  EXPECT_TRUE(bench_.host.queued.empty()) << "queued transfers are completed, too";
  bench_.run(100, 2);
  EXPECT_EQ(received(), before);
  EXPECT_GT(bench_.host.count(TransferStatus::stalled), 5);
  EXPECT_FALSE(bench_.stream.next_due());
  bench_.stream.clear_halt();
  bench_.run(100);
  EXPECT_GT(received() - before, 7U);
  EXPECT_EQ(bench_.stream.streams(), 2U);
}

TEST_P(Fault, AnInterruptedFrameIsLoggedAsAborted) {
  // One of three transfers is sent when the stream ends.
  StreamBench bench(GetParam());
  bench.arm();
  bench.host.queue(bench.stream, 1);
  bench.stream.run(bench.now, bench.host);
  bench.now = bench.now + Duration{11 * bench::kMs};
  bench.stream.run(bench.now, bench.host);
  bench.stream.reset();
  ASSERT_EQ(bench.log.count(Outcome::aborted), 1U);
  EXPECT_EQ(bench.log.records().back().sent, 16384U - 12);
  EXPECT_FALSE(bench.stream.negotiated_format());
  bench.run(100);
  EXPECT_EQ(bench.log.records().size(), 1U) << "nothing without a new commit";
}

INSTANTIATE_TEST_SUITE_P(Paces, Fault, ::testing::Values(Pace::rate, Pace::guest));

TEST(FaultOfJpeg, FramesMayBeShorterThanNegotiated) {
  StreamBench bench(Pace::guest);
  // The last transfer is exactly full, or not full.
  for (const std::size_t bytes : {std::size_t{16384 - 12}, std::size_t{5000}}) {
    bench.source.short_by = 160 * 120 * 2 - bytes;
    bench.arm(Encoding::mjpeg);
    const std::size_t before = bench.host.frames.size();
    bench.run(100);
    ASSERT_GT(bench.host.frames.size(), before + 5);
    EXPECT_EQ(bench.host.frames.back().bytes.size(), bytes);
  }
}

}  // namespace
}  // namespace lightwell::usb_camera
