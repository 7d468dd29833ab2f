// Tests of disconnection, timeout and reconnection of a V4L2 device.
#include <chrono>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <lightwell/bytes.hpp>

#include "firmware/camera/v4l2_watcher.hpp"

namespace lightwell {
namespace {

using State = CameraBackend::State;
using test::DeviceKind;
using test::OpenCamera;
using test::UmockCamera;
using test::webcam;
using ::testing::HasSubstr;

int threads() {
  int count = 0;
  for ([[maybe_unused]] const auto& task : std::filesystem::directory_iterator("/proc/self/task")) ++count;
  return count;
}

std::uint32_t checksum(const Frame& frame) { return crc32c(frame.views()[0].data, 0); }

TEST(V4l2Replug, FramesResumeWithinTwoSeconds) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("&exposure=3ms");
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(5));
  plugged.unplug();
  ASSERT_TRUE(open.becomes(State::lost));
  const std::size_t before = open.sink.count();
  const std::uint64_t last = open.sink.seen().back().info.sequence;
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  EXPECT_EQ(open.sink.count(), before);

  const auto back = std::chrono::steady_clock::now();
  plugged.plug_in();
  ASSERT_TRUE(open.sink.more_come(1));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - back;
  EXPECT_LT(took.count(), 2.0);
  RecordProperty("back_after_ms", static_cast<int>(1000 * took.count()));
  EXPECT_EQ(open.camera->state(), State::streaming);
  const std::uint64_t first = open.sink.seen()[before].info.sequence;
  EXPECT_GE(first - last - 1, 20U) << "0.4 s at 50 frames a second were lost";
  EXPECT_EQ(plugged.device().control(V4L2_CID_EXPOSURE_ABSOLUTE), 30) << "the exposure must be set again";
  EXPECT_EQ(open.camera->counts().disconnects, 1U);
}

TEST(V4l2Replug, ACameraWithAnotherNodeNumberAtTheSamePortIsFound) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("");
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(2));
  plugged.unplug();
  ASSERT_TRUE(open.becomes(State::lost));
  plugged.plug_in_renumbered();
  ASSERT_TRUE(open.sink.more_come(2)) << "the old number is still in use";
  plugged.unplug();
  ASSERT_TRUE(open.becomes(State::lost));
  plugged.plug_in();
  EXPECT_TRUE(open.sink.more_come(2)) << "the old number is free again";
}

TEST(V4l2Replug, TheInitialExposureIsKept) {
  DeviceKind kind = webcam(V4L2_PIX_FMT_YUYV);
  UmockCamera plugged(kind);
  OpenCamera open("");
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(2));
  plugged.unplug();
  ASSERT_TRUE(open.becomes(State::lost));
  kind.controls[V4L2_CID_EXPOSURE_ABSOLUTE].value = 250;
  plugged.plug_in(kind);
  ASSERT_TRUE(open.sink.more_come(4));
  EXPECT_EQ(plugged.device().control(V4L2_CID_EXPOSURE_ABSOLUTE), 100);
  EXPECT_EQ(open.sink.seen().back().info.exposure_s, open.info.exposure_s[0]);
}

TEST(V4l2Replug, RepeatedReconnectionsLeakNothing) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("&exposure=1ms,8ms&control_delay=2");
  ASSERT_TRUE(open.start());
  int descriptors = 0, mappings = 0, running = 0;
  for (int round = 0; round < 8; ++round) {
    ASSERT_TRUE(open.sink.more_come(3));
    plugged.unplug();
    ASSERT_TRUE(open.becomes(State::lost));
    plugged.plug_in();
    ASSERT_TRUE(open.sink.more_come(3));
    // The simulated device keeps one mapping per round; umockdev closes its descriptors a little later.
    const int own = UmockCamera::mappings() - round;
    if (round == 1) {
      descriptors = UmockCamera::descriptors();
      mappings = own;
      running = threads();
    } else if (round > 1) {
      EXPECT_TRUE(
          test::becomes_true("no descriptor is left over", [&] { return UmockCamera::descriptors() <= descriptors; }));
      EXPECT_EQ(own, mappings);
      EXPECT_EQ(threads(), running);
    }
  }
  EXPECT_EQ(open.camera->counts().disconnects, 8U);
}

TEST(V4l2Replug, HeldFramesAreUnchangedUntilReleased) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("");
  open.sink.keep(2);
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(4));
  const int mapped = UmockCamera::mappings();
  std::vector<Frame> held = open.sink.take_kept();
  ASSERT_EQ(held.size(), 2U);
  const std::uint32_t sums[] = {checksum(held[0]), checksum(held[1])};
  const int exported = open.camera->dma_buffer(held[0].views()[0])->fd;

  plugged.unplug();
  ASSERT_TRUE(open.becomes(State::lost));
  EXPECT_EQ(checksum(held[0]), sums[0]);
  plugged.plug_in();
  ASSERT_TRUE(open.sink.more_come(10));
  EXPECT_EQ(checksum(held[0]), sums[0]);
  EXPECT_EQ(checksum(held[1]), sums[1]);
  EXPECT_EQ(open.camera->dma_buffer(held[0].views()[0])->fd, exported);
  const int mapped_twice = UmockCamera::mappings();
  EXPECT_GT(mapped_twice, mapped + 1) << "the old buffers must still be mapped";
  held.clear();
  EXPECT_LT(UmockCamera::mappings(), mapped_twice) << "they must be unmapped with the last frame";
  EXPECT_TRUE(open.sink.more_come(10));
}

TEST(V4l2Replug, FramesHeldOverReconnectionsCountAgainstTheLimit) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("");
  ASSERT_TRUE(open.start());
  std::vector<Frame> held;
  std::vector<std::uint32_t> sums;
  for (int round = 0; round < required_buffer_count(1); ++round) {
    open.sink.keep(1);
    ASSERT_TRUE(open.sink.more_come(1));
    for (Frame& frame : open.sink.take_kept()) {
      sums.push_back(checksum(frame));
      held.push_back(std::move(frame));
    }
    plugged.unplug();
    ASSERT_TRUE(open.becomes(State::lost));
    plugged.plug_in();
    ASSERT_TRUE(open.becomes(State::streaming));
  }
  ASSERT_EQ(held.size(), static_cast<std::size_t>(required_buffer_count(1)));
  ASSERT_TRUE(test::becomes_true("all are out", [&] { return open.camera->counts().no_free_buffer > 3; }));
  for (std::size_t i = 0; i < held.size(); ++i) EXPECT_EQ(checksum(held[i]), sums[i]);
  held.clear();
  EXPECT_TRUE(open.sink.more_come(3));
}

TEST(V4l2Replug, TheDeviceIsFoundByItsSymbolicLink) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_MJPEG));
  OpenCamera open("", UmockCamera::path_by_id());
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(2));
  plugged.unplug();
  ASSERT_TRUE(open.becomes(State::lost));
  plugged.plug_in();
  EXPECT_TRUE(open.sink.more_come(2));
}

TEST(V4l2Replug, AnotherCameraAtTheSameNodeIsRefused) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("");
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(2));
  plugged.unplug();
  ASSERT_TRUE(open.becomes(State::lost));
  const std::size_t before = open.sink.count();
  plugged.plug_in(webcam(V4L2_PIX_FMT_NV12));
  std::this_thread::sleep_for(std::chrono::milliseconds(800));
  EXPECT_EQ(open.camera->state(), State::lost);
  EXPECT_EQ(open.sink.count(), before);
  plugged.plug_in(webcam(V4L2_PIX_FMT_YUYV));
  EXPECT_TRUE(open.sink.more_come(2));
}

TEST(V4l2Replug, ADeviceWithoutFramesIsReopened) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("&exposure=1ms");
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(2));
  plugged.device().stop_delivery(true);
  ASSERT_TRUE(test::becomes_true("the silence is seen", [&] { return open.camera->counts().disconnects == 1; }));
  plugged.device().stop_delivery(false);
  EXPECT_TRUE(open.sink.more_come(2));
}

TEST(V4l2Replug, ADeviceThatTakesThreeSecondsToWakeUpIsNotLost) {
  DeviceKind sleepy = webcam(V4L2_PIX_FMT_YUYV);
  sleepy.wakes_up = std::chrono::milliseconds(3000);
  const UmockCamera plugged(sleepy);
  OpenCamera open("");
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(3));
  EXPECT_EQ(open.camera->counts().disconnects, 0U);
}

TEST(V4l2Replug, StoppingAndStartingWhileItIsAway) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("");
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(2));
  plugged.unplug();
  ASSERT_TRUE(open.becomes(State::lost));
  open.camera->stop();
  EXPECT_EQ(open.camera->state(), State::idle);
  const Status away = open.camera->start(open.sink);
  EXPECT_FALSE(away.ok());
  EXPECT_THAT(away.message(), HasSubstr(UmockCamera::path()));
  plugged.plug_in();
  ASSERT_TRUE(open.start());
  EXPECT_TRUE(open.sink.more_come(2));
}

TEST(V4l2Replug, StartReconnectsAfterAnUnnoticedReconnection) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("");
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(2));
  open.camera->stop();
  plugged.unplug();
  plugged.plug_in();
  ASSERT_TRUE(open.start());
  EXPECT_TRUE(open.sink.more_come(2));
}

}  // namespace
}  // namespace lightwell
