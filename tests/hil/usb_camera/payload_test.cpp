#include <tuple>

#include <gtest/gtest.h>

#include "hil/usb_camera/video_host.hpp"
#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera {
namespace {

std::vector<std::byte> bytes(std::size_t n) {
  std::vector<std::byte> out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = static_cast<std::byte>(7 * i + (i >> 8));
  return out;
}

/// Parameters: bytes of the frame, of a payload (0: one payload), of a transfer.
class PayloadSplitting : public ::testing::TestWithParam<std::tuple<std::size_t, std::size_t, std::size_t>> {};

TEST_P(PayloadSplitting, TheHostReassemblesTheFrame) {
  const auto [frame, asked, transfer] = GetParam();
  const auto payload = static_cast<std::uint32_t>(asked == 0 ? frame + 12 : asked);
  const std::vector<std::byte> picture = bytes(frame);
  PayloadSplitter splitter(picture, payload, {true, false, 0xCAFE1234});
  EXPECT_FALSE(splitter.begun());
  bench::VideoHost host(payload, transfer);
  Bytes out;
  for (int i = 0; !splitter.done(); ++i) {
    ASSERT_LT(i, 200'000) << "the frame does not end";
    splitter.fill(transfer, {5'000'000'000}, out);
    ASSERT_LE(out.size(), transfer);
    host.complete(0, TransferStatus::success, out);
  }
  EXPECT_TRUE(splitter.begun());
  EXPECT_EQ(splitter.sent(), frame);
  ASSERT_EQ(host.frames.size(), 1U);
  const auto& got = host.frames[0].bytes;
  ASSERT_EQ(got.size(), frame);
  EXPECT_TRUE(std::equal(got.begin(), got.end(), reinterpret_cast<const std::uint8_t*>(picture.data())));
  EXPECT_EQ(host.frames[0].payloads, (frame + payload - 13) / (payload - 12));
  EXPECT_EQ(host.frames[0].presentation, 0xCAFE1234U);
  EXPECT_EQ(host.source_clocks.front(), 5'000'000U);
  EXPECT_EQ(host.bus_frames.front(), 5000U % 2048);
}

// Includes payloads that fill their transfers exactly, with and without the negotiated length.
INSTANTIATE_TEST_SUITE_P(Sizes, PayloadSplitting,
                         ::testing::Values(std::tuple{614400, 0, 16384}, std::tuple{16384 - 12, 0, 16384},
                                           std::tuple{16384, 0, 16384}, std::tuple{2 * 16384 - 12, 0, 16384},
                                           std::tuple{100000, 16384, 16384}, std::tuple{100000, 3000, 3072},
                                           std::tuple{2 * (3000 - 12) + 500, 3000, 512}, std::tuple{1, 0, 512},
                                           std::tuple{5 * (1024 - 12), 1024, 512}, std::tuple{2024, 1024, 512},
                                           std::tuple{100, 0, 12}));

TEST(SplittingShortFrames, AnEmptyTransferEndsAPayloadThatFillsItsTransfers) {
  // As with motion JPEG: the negotiated payload is longer than this frame, which ends at the end of a transfer.
  const std::vector<std::byte> picture = bytes(1024 - 12);
  PayloadSplitter splitter(picture, 5000, {});
  Bytes out;
  splitter.fill(1024, {}, out);
  EXPECT_EQ(out.size(), 1024U);
  EXPECT_FALSE(splitter.done()) << "the host cannot know yet that the payload has ended";
  splitter.fill(1024, {}, out);
  EXPECT_TRUE(out.empty());
  EXPECT_TRUE(splitter.done());
}

TEST(SplittingMarkedFrames, TheHostReceivesTheErrorBit) {
  const std::vector<std::byte> picture = bytes(2000);
  PayloadSplitter splitter(picture, 4000, {false, true, 0});
  bench::VideoHost host(4000, 512);
  Bytes out;
  while (!splitter.done()) {
    splitter.fill(512, {}, out);
    host.complete(0, TransferStatus::success, out);
  }
  ASSERT_EQ(host.frames.size(), 1U);
  EXPECT_TRUE(host.frames[0].error);
  EXPECT_FALSE(host.frames[0].frame_id);
  EXPECT_EQ(host.frames[0].bytes.size(), 2000U);
}

TEST(Clock, CountsMicrosecondsAndMillisecondsAndWraps) {
  EXPECT_EQ(clock_ticks({1'000}), 1U);
  EXPECT_EQ(clock_ticks({4'294'967'296'000}), 0U);
  EXPECT_EQ(start_of_frame({2047 * std::int64_t{1'000'000}}), 2047);
  EXPECT_EQ(start_of_frame({2048 * std::int64_t{1'000'000}}), 0);
}

}  // namespace
}  // namespace lightwell::usb_camera
