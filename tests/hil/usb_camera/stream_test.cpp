// Timing of frames at each pace, latency of controls, and consistency of the frame log.
#include "usb_camera/stream.hpp"

#include <gtest/gtest.h>

#include "hil/usb_camera/stream_bench.hpp"

namespace lightwell::usb_camera {
namespace {

using bench::kMs;
using bench::StreamBench;

/// Each received frame equals the logged one, has its presentation time, and FID alternates.
void expect_frames_match_log(const StreamBench& bench) {
  std::vector<FrameRecord> sent = bench.with(Outcome::sent);
  ASSERT_EQ(bench.host.frames.size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(bench.host.frames[i].bytes, bench.expected(sent[i])) << "frame " << sent[i].number;
    EXPECT_EQ(bench.host.frames[i].presentation, clock_ticks(sent[i].began));
    EXPECT_EQ(sent[i].sent, sent[i].bytes);
    if (i > 0 && sent[i].stream == sent[i - 1].stream) {
      EXPECT_NE(bench.host.frames[i].frame_id, bench.host.frames[i - 1].frame_id);
    }
  }
}

/// For one stream: the log has every frame number from 0 exactly once.
void expect_every_number_once(const StreamBench& bench) {
  std::vector<std::uint64_t> numbers;
  for (const FrameRecord& r : bench.log.records()) numbers.push_back(r.number);
  std::sort(numbers.begin(), numbers.end());
  for (std::size_t i = 0; i < numbers.size(); ++i) ASSERT_EQ(numbers[i], i);
}

TEST(StreamAtRate, SendsCompleteFramesAtTheNegotiatedRate) {
  StreamBench bench(Pace::rate);
  bench.arm();
  bench.run(1000);
  EXPECT_NEAR(static_cast<double>(bench.host.frames.size()), 100, 1);
  expect_frames_match_log(bench);
  expect_every_number_once(bench);
  const auto sent = bench.with(Outcome::sent);
  for (std::size_t i = 1; i < sent.size(); ++i) EXPECT_EQ((sent[i].began - sent[i - 1].began).ns, 10 * kMs);
}

TEST(StreamAtRate, SendsNothingBeforeACommitAndATransfer) {
  StreamBench bench(Pace::rate);
  bench.run(100);
  EXPECT_TRUE(bench.log.records().empty());
  EXPECT_EQ(bench.host.count(TransferStatus::success), 0) << "transfers stay queued";
  StreamBench armed(Pace::rate);
  armed.arm();
  armed.run(100, 0);
  EXPECT_TRUE(armed.log.records().empty());
  EXPECT_FALSE(armed.stream.next_due()) << "no timer is needed";
  armed.run(100);
  EXPECT_GT(armed.host.frames.size(), 5U);
  EXPECT_EQ(armed.log.records().front().number, 0U);
}

TEST(StreamAtRate, ReplacesFramesThatTheHostDoesNotFetch) {
  StreamBench bench(Pace::rate);
  bench.arm();
  // A frame takes three transfers; those still queued when the host stops take one more frame.
  bench.run(100, 3);
  const std::size_t before = bench.host.frames.size();
  bench.run(100, 0);
  bench.run(100, 3);
  EXPECT_NEAR(static_cast<double>(bench.log.count(Outcome::replaced)), 9, 2);
  EXPECT_GT(bench.host.frames.size(), before);
  expect_frames_match_log(bench);
  bench.stream.stop();
  expect_every_number_once(bench);
}

TEST(StreamAtRate, DropsFramesWhileOneIsBeingSent) {
  // 38,412 bytes take three transfers of 16 KiB. The host queues one, then none for two frame intervals.
  StreamBench slow(Pace::rate);
  slow.arm();
  slow.host.queue(slow.stream, 1);
  slow.stream.run(slow.now, slow.host);
  slow.now = slow.now + Duration{10 * kMs};
  slow.stream.run(slow.now, slow.host);
  slow.run(25, 0);
  EXPECT_GE(slow.log.count(Outcome::busy), 2U);
  slow.run(30);
  expect_frames_match_log(slow);
  slow.stream.stop();
  expect_every_number_once(slow);
}

TEST(StreamAtRate, CountsUnrenderedFrames) {
  StreamBench bench(Pace::rate);
  bench.source.not_ready = {3, 4};
  bench.arm();
  bench.run(200);
  EXPECT_EQ(bench.log.count(Outcome::unrendered), 2U);
  expect_frames_match_log(bench);
  expect_every_number_once(bench);
}

TEST(StreamAtRate, TheClockStartsWithTheFirstImage) {
  StreamBench bench(Pace::rate);
  bench.source.not_ready = {0};
  bench.arm();
  bench.run(300);
  EXPECT_TRUE(bench.log.records().empty());
  bench.source.not_ready.clear();
  bench.run(50);
  EXPECT_EQ(bench.log.records().front().outcome, Outcome::sent);
  EXPECT_EQ(bench.log.records().front().number, 0U);
}

TEST(StreamAtRate, ALongExposureLowersTheRate) {
  StreamBench bench(Pace::rate);
  bench.settings.exposure_s = 0.04;
  bench.arm();
  bench.run(400);
  EXPECT_NEAR(static_cast<double>(bench.host.frames.size()), 9.5, 0.6);
  const FrameRecord& first = bench.log.records().front();
  EXPECT_EQ((first.began - CameraTime{1'000'000'000'000}).ns, 0) << "exposed from the start of the stream";
}

TEST(StreamAtRate, RecoversAfterTheMachineWasSuspended) {
  StreamBench bench(Pace::rate);
  bench.arm();
  bench.run(50);
  bench.now = bench.now + Duration{3'600'000'000'000};
  bench.run(100);
  EXPECT_LE((*bench.stream.next_due() - bench.now).ns, 10 * kMs);
  EXPECT_GE((*bench.stream.next_due() - bench.now).ns, -kMs);
}

TEST(StreamForGuest, DropsNothingWithASlowHost) {
  StreamBench bench(Pace::guest);
  bench.arm();
  for (int i = 0; i < 40; ++i) {
    bench.run(3, 1);
    bench.run(17, 0);
  }
  bench.run(30);
  EXPECT_EQ(bench.log.count(Outcome::sent), bench.log.records().size());
  EXPECT_GT(bench.host.frames.size(), 5U);
  expect_frames_match_log(bench);
  expect_every_number_once(bench);
}

TEST(StreamForGuest, KeepsTheNegotiatedRate) {
  StreamBench bench(Pace::guest);
  bench.arm();
  bench.run(1000);
  EXPECT_NEAR(static_cast<double>(bench.host.frames.size()), 100, 2);
}

TEST(StreamForGuest, WaitsForTheImage) {
  StreamBench bench(Pace::guest);
  bench.source.not_ready = {2};
  bench.arm();
  bench.run(200);
  EXPECT_EQ(bench.host.frames.size(), 2U);
  EXPECT_FALSE(bench.stream.next_due()) << "the renderer wakes the stream";
  bench.source.not_ready.clear();
  bench.run(100);
  EXPECT_GT(bench.host.frames.size(), 8U);
  expect_frames_match_log(bench);
  expect_every_number_once(bench);
}

TEST(StreamFree, SendsAsFastAsTheHostFetches) {
  StreamBench bench(Pace::free);
  bench.arm();
  bench.run(100);
  EXPECT_GT(bench.host.frames.size(), 300U);
  expect_frames_match_log(bench);
}

class Latency : public ::testing::TestWithParam<int> {};

TEST_P(Latency, AControlActsFromTheFrameStated) {
  for (const Pace pace : {Pace::rate, Pace::guest}) {
    StreamBench bench(pace, GetParam());
    bench.arm();
    bench.run(35);
    const std::uint64_t exposing = bench.log.records().back().number + 1;
    bench.set_exposure(0.003);
    bench.set_exposure(0.004);  // The last one counts.
    bench.run(100);
    for (const FrameRecord& r : bench.with(Outcome::sent)) {
      const bool acts = r.number >= exposing + static_cast<std::uint64_t>(GetParam());
      EXPECT_DOUBLE_EQ(r.settings.exposure_s, acts ? 0.004 : 0.002) << "frame " << r.number;
    }
    expect_frames_match_log(bench);
  }
}

INSTANTIATE_TEST_SUITE_P(Frames, Latency, ::testing::Values(0, 1, 2, 5));

TEST(Controls, EveryFrameOfABracketHasItsExposure) {
  StreamBench bench(Pace::rate);
  bench.arm();
  std::map<std::uint64_t, double> wanted;
  for (int i = 0; i < 40; ++i) {
    bench.run(10);
    const std::uint64_t exposing = bench.log.records().empty() ? 0 : bench.log.records().back().number + 1;
    const double exposure = i % 2 == 0 ? 0.001 : 0.008;
    bench.set_exposure(exposure);
    wanted[exposing + 2] = exposure;
  }
  int compared = 0;
  for (const FrameRecord& r : bench.with(Outcome::sent)) {
    if (!wanted.contains(r.number)) continue;
    EXPECT_DOUBLE_EQ(r.settings.exposure_s, wanted[r.number]) << "frame " << r.number;
    ++compared;
  }
  EXPECT_GT(compared, 30);
  expect_frames_match_log(bench);
}

TEST(Stream, OrdersImagesBeforeTheyAreDue) {
  StreamBench bench(Pace::rate);
  bench.arm();
  bench.run(12);
  bench.set_exposure(0.005);
  const std::uint64_t exposing = bench.log.records().back().number + 1;
  ASSERT_TRUE(bench.source.ordered.contains(exposing + 3));
  EXPECT_DOUBLE_EQ(bench.source.ordered[exposing + 1].exposure_s, 0.002);
  EXPECT_DOUBLE_EQ(bench.source.ordered[exposing + 2].exposure_s, 0.005);
}

TEST(Stream, StopEndsTheFrameAndTheNextStreamBeginsAtZero) {
  StreamBench bench(Pace::rate);
  bench.arm();
  bench.run(55);
  bench.stream.clear_halt();
  EXPECT_FALSE(bench.stream.streaming());
  bench.run(55);
  EXPECT_EQ(bench.stream.streams(), 2U);
  const auto sent = bench.with(Outcome::sent);
  EXPECT_EQ(sent.back().stream, 2U);
  EXPECT_LT(sent.back().number, 6U);
  expect_frames_match_log(bench);
}

TEST(Stream, ACancelledTransferIsCompletedOnce) {
  StreamBench bench(Pace::rate);
  bench.arm();
  bench.host.queue(bench.stream, 3);
  const std::uint64_t id = bench.host.queued[1];
  bench.stream.cancel(id, bench.host);
  bench.stream.cancel(id, bench.host);
  bench.stream.cancel(12345, bench.host);
  EXPECT_EQ(bench.host.count(TransferStatus::cancelled), 1);
  bench.run(50);
  EXPECT_EQ(std::count(bench.host.ids.begin(), bench.host.ids.end(), id), 1);
  expect_frames_match_log(bench);
}

TEST(Stream, TransfersAreBounded) {
  StreamBench bench(Pace::rate);
  for (std::uint64_t id = 0; id < 1000; ++id) bench.stream.submit(id, 512, bench.host);
  EXPECT_EQ(bench.stream.waiting_transfers(), Stream::kMaxTransfers);
  EXPECT_EQ(bench.host.count(TransferStatus::refused), 1000 - static_cast<int>(Stream::kMaxTransfers));
  StreamBench other(Pace::rate);
  other.stream.submit(1, Stream::kMaxTransferBytes + 1, other.host);
  EXPECT_EQ(other.host.count(TransferStatus::refused), 1);
}

TEST(Stream, ExposureStartsBeforeTheReadout) {
  StreamBench bench(Pace::rate);
  bench.source.readout = 0.004;
  bench.arm();
  bench.run(30);
  const auto sent = bench.with(Outcome::sent);
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ((sent[0].began - CameraTime{1'000'000'000'000}).ns, (10 - 2 - 4) * kMs) << "due - exposure - readout";
}

}  // namespace
}  // namespace lightwell::usb_camera
