// Frames at their time: both paces, controls that act later, and numbers that add up.
#include "usb_camera/stream.hpp"

#include <gtest/gtest.h>

#include "hil/usb_camera/stream_bench.hpp"

namespace lightwell::usb_camera {
namespace {

using bench::kMs;
using bench::StreamBench;

/// Each frame received is the one that the log says was sent, with its presentation time, and FID alternates.
void expect_account(const StreamBench& bench) {
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

/// Of one stream: every number from 0 once.
void expect_every_number_once(const StreamBench& bench) {
  std::vector<std::uint64_t> numbers;
  for (const FrameRecord& r : bench.log.records()) numbers.push_back(r.number);
  std::sort(numbers.begin(), numbers.end());
  for (std::size_t i = 0; i < numbers.size(); ++i) ASSERT_EQ(numbers[i], i);
}

TEST(StreamAtRate, SendsWholeFramesAtTheAgreedRate) {
  StreamBench bench(Pace::rate);
  bench.arm();
  bench.run(1000);
  EXPECT_NEAR(static_cast<double>(bench.host.frames.size()), 100, 1);
  expect_account(bench);
  expect_every_number_once(bench);
  const auto sent = bench.with(Outcome::sent);
  for (std::size_t i = 1; i < sent.size(); ++i) EXPECT_EQ((sent[i].began - sent[i - 1].began).ns, 10 * kMs);
}

TEST(StreamAtRate, SendsNothingBeforeACommitAndATransfer) {
  StreamBench bench(Pace::rate);
  bench.run(100);
  EXPECT_TRUE(bench.log.records().empty());
  EXPECT_EQ(bench.host.count(TransferStatus::success), 0) << "transfers wait, as on a device that has nothing";
  StreamBench armed(Pace::rate);
  armed.arm();
  armed.run(100, 0);
  EXPECT_TRUE(armed.log.records().empty());
  EXPECT_FALSE(armed.stream.next_due()) << "nothing to wake up for";
  armed.run(100);
  EXPECT_GT(armed.host.frames.size(), 5U);
  EXPECT_EQ(armed.log.records().front().number, 0U);
}

TEST(StreamAtRate, ReplacesWhatTheHostDoesNotTake) {
  StreamBench bench(Pace::rate);
  bench.arm();
  // Three transfers are a frame: what is left when the host stops asking takes a whole one.
  bench.run(100, 3);
  const std::size_t before = bench.host.frames.size();
  bench.run(100, 0);
  bench.run(100, 3);
  EXPECT_NEAR(static_cast<double>(bench.log.count(Outcome::replaced)), 9, 2);
  EXPECT_GT(bench.host.frames.size(), before);
  expect_account(bench);
  bench.stream.stop();
  expect_every_number_once(bench);
}

TEST(StreamAtRate, IsBusyWhileAFrameIsOnItsWay) {
  // 38,412 bytes take three transfers of 16 KiB: the host asks for one, then for nothing for two frames' time.
  StreamBench slow(Pace::rate);
  slow.arm();
  slow.host.queue(slow.stream, 1);
  slow.stream.run(slow.now, slow.host);
  slow.now = slow.now + Duration{10 * kMs};
  slow.stream.run(slow.now, slow.host);
  slow.run(25, 0);
  EXPECT_GE(slow.log.count(Outcome::busy), 2U);
  slow.run(30);
  expect_account(slow);
  slow.stream.stop();
  expect_every_number_once(slow);
}

TEST(StreamAtRate, CountsWhatWasNotRendered) {
  StreamBench bench(Pace::rate);
  bench.source.not_ready = {3, 4};
  bench.arm();
  bench.run(200);
  EXPECT_EQ(bench.log.count(Outcome::unrendered), 2U);
  expect_account(bench);
  expect_every_number_once(bench);
}

TEST(StreamAtRate, ItsClockStartsWithItsFirstPicture) {
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
  EXPECT_EQ((first.began - CameraTime{1'000'000'000'000}).ns, 0) << "exposed from the start on";
}

TEST(StreamAtRate, AMachineThatSleptCatchesUp) {
  StreamBench bench(Pace::rate);
  bench.arm();
  bench.run(50);
  bench.now = bench.now + Duration{3'600'000'000'000};
  bench.run(100);
  EXPECT_LE((*bench.stream.next_due() - bench.now).ns, 10 * kMs);
  EXPECT_GE((*bench.stream.next_due() - bench.now).ns, -kMs);
}

TEST(StreamForGuest, LosesNothingHoweverSlowTheHost) {
  StreamBench bench(Pace::guest);
  bench.arm();
  for (int i = 0; i < 40; ++i) {
    bench.run(3, 1);
    bench.run(17, 0);
  }
  bench.run(30);
  EXPECT_EQ(bench.log.count(Outcome::sent), bench.log.records().size());
  EXPECT_GT(bench.host.frames.size(), 5U);
  expect_account(bench);
  expect_every_number_once(bench);
}

TEST(StreamForGuest, IsNoFasterThanTheRateAndKeepsIt) {
  StreamBench bench(Pace::guest);
  bench.arm();
  bench.run(1000);
  EXPECT_NEAR(static_cast<double>(bench.host.frames.size()), 100, 2);
}

TEST(StreamForGuest, WaitsForItsPicture) {
  StreamBench bench(Pace::guest);
  bench.source.not_ready = {2};
  bench.arm();
  bench.run(200);
  EXPECT_EQ(bench.host.frames.size(), 2U);
  EXPECT_FALSE(bench.stream.next_due()) << "whoever renders says when it goes on";
  bench.source.not_ready.clear();
  bench.run(100);
  EXPECT_GT(bench.host.frames.size(), 8U);
  expect_account(bench);
  expect_every_number_once(bench);
}

TEST(StreamFree, IsAsFastAsTheHost) {
  StreamBench bench(Pace::free);
  bench.arm();
  bench.run(100);
  EXPECT_GT(bench.host.frames.size(), 300U);
  expect_account(bench);
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
    expect_account(bench);
  }
}

INSTANTIATE_TEST_SUITE_P(Frames, Latency, ::testing::Values(0, 1, 2, 5));

TEST(Controls, EveryFrameOfABracketHasItsOwn) {
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
  expect_account(bench);
}

TEST(Stream, OrdersPicturesBeforeTheyAreDue) {
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
  expect_account(bench);
}

TEST(Stream, ACancelledTransferIsAnsweredOnce) {
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
  expect_account(bench);
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

TEST(Stream, ShutterOpensBeforeTheReadout) {
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
