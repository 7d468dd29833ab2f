// Tests that no memory is allocated between the driver's frame and the sink. Allocations are counted per thread,
// because the simulated device runs in the same process.
#include <atomic>
#include <cstddef>
#include <iostream>

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "firmware/camera/v4l2_watcher.hpp"
#include "support/allocation_counter.hpp"

namespace lightwell {
namespace {

using test::UmockCamera;
using test::webcam;

/// Counts the allocations of the camera's thread; does not allocate.
class Counter final : public FrameSink {
 public:
  void push(Frame /*frame*/) override {
    constexpr int kFirst = 10;
    if (++frames == kFirst) at_first = test::allocations_of_this_thread();
    if (frames == kFirst + kFrames) taken = test::allocations_of_this_thread() - at_first;
    if (frames >= kFirst + kFrames) done = true;
  }
  static constexpr int kFrames = 40;
  int frames = 0;
  std::size_t at_first = 0, taken = 0;
  std::atomic<bool> done{false};
};

/// Number of allocations for forty frames.
std::size_t taken_for(std::uint32_t fourcc, const std::string& parameters) {
  const UmockCamera plugged(webcam(fourcc));
  const auto camera = test::make_camera(parameters);
  EXPECT_TRUE((*camera)->open().ok());
  Counter counter;
  EXPECT_TRUE((*camera)->start(counter).ok());
  EXPECT_TRUE(test::becomes_true("all frames have come", [&] { return counter.done.load(); }));
  (*camera)->stop();
  return counter.taken;
}

TEST(V4l2Allocation, TheCounterCounts) {
  const std::size_t before = test::allocations_of_this_thread();
  const auto taken = std::make_unique<std::vector<int>>(100);
  EXPECT_EQ(test::allocations_of_this_thread() - before, 2U) << taken->size();
}

TEST(V4l2Allocation, NonePerFrameIfTheDriversMemoryIsLent) { EXPECT_EQ(taken_for(V4L2_PIX_FMT_YUYV, ""), 0U); }

TEST(V4l2Allocation, NonePerFrameOfABracket) {
  EXPECT_EQ(taken_for(V4L2_PIX_FMT_NV12, "&exposure=1ms,8ms&control_delay=2"), 0U);
}

TEST(V4l2Allocation, NonePerDecodedFrame) { EXPECT_EQ(taken_for(V4L2_PIX_FMT_MJPEG, ""), 0U); }

TEST(V4l2Allocation, NonePerUnpackedFrame) { EXPECT_EQ(taken_for(V4L2_PIX_FMT_SBGGR12P, ""), 0U); }

}  // namespace
}  // namespace lightwell
