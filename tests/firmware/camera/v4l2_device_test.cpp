// Tests of the V4L2 backend: open, controls, frames, times, brackets.
#include <algorithm>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "firmware/camera/v4l2_watcher.hpp"

namespace lightwell {
namespace {

using test::DeviceKind;
using test::OpenCamera;
using test::UmockCamera;
using test::webcam;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(V4l2Open, AMissingDeviceIsReportedWithTheExistingOnes) {
  const UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  const Status s = test::open_status("", "/dev/video89");
  EXPECT_EQ(s.code(), StatusCode::not_found);
  EXPECT_THAT(s.message(), HasSubstr("/dev/video89"));
  EXPECT_THAT(s.message(), HasSubstr("/dev/video90 (Test Camera)"));
}

TEST(V4l2Open, ADeviceInUseIsReported) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  plugged.device().set_busy(true);
  const Status s = test::open_status("");
  EXPECT_EQ(s.code(), StatusCode::unavailable);
  EXPECT_THAT(s.message(), HasSubstr("in use by another program"));
  plugged.device().set_busy(false);
  EXPECT_TRUE(test::open_status("").ok());
}

TEST(V4l2Open, NonCamerasAreRefused) {
  DeviceKind metadata = webcam(V4L2_PIX_FMT_YUYV);
  metadata.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  UmockCamera plugged(metadata);
  const Status node = test::open_status("");
  EXPECT_EQ(node.code(), StatusCode::invalid_argument);
  EXPECT_THAT(node.message(), HasSubstr("is no capture device"));

  DeviceKind planes = metadata;
  planes.capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  plugged.plug_in(planes);
  EXPECT_THAT(test::open_status("").message(), HasSubstr("several planes"));

  DeviceKind reads = metadata;
  reads.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE;
  plugged.plug_in(reads);
  EXPECT_THAT(test::open_status("").message(), HasSubstr("cannot stream"));

  const Status null = test::open_status("", "/dev/null");
  EXPECT_EQ(null.code(), StatusCode::invalid_argument);
  EXPECT_THAT(null.message(), HasSubstr("is no V4L2 device"));
}

TEST(V4l2Open, AnUnsupportedFormatIsNamed) {
  const UmockCamera plugged(webcam(V4L2_PIX_FMT_H264));
  EXPECT_THAT(test::open_status("").message(), HasSubstr("H264"));
}

TEST(V4l2Open, StepwiseSizesAreSupported) {
  DeviceKind kind = webcam(V4L2_PIX_FMT_YUYV);
  kind.formats.front().sizes.clear();
  kind.formats.front().steps = {16, 320, 16, 16, 240, 8};
  const UmockCamera plugged(kind);
  const auto camera = test::make_camera("");
  ASSERT_TRUE(camera.ok());
  const Result<CameraInfo> info = (*camera)->open();
  ASSERT_TRUE(info.ok()) << info.status().message();
  EXPECT_EQ(info->width, 64);
  EXPECT_EQ(info->height, 48);
}

TEST(V4l2Open, ADifferentSizeOrRateIsNoted) {
  DeviceKind kind = webcam(V4L2_PIX_FMT_YUYV);
  kind.may_shrink = true;
  kind.formats.front().rates = {25};
  const UmockCamera plugged(kind);
  const OpenCamera open("");
  EXPECT_EQ(open.info.width, 32);
  EXPECT_EQ(open.info.height, 24);
  EXPECT_EQ(open.info.frame_rate, 25);
  EXPECT_THAT(open.notes(), HasSubstr("pictures of 32x24 in place of 64x48"));
  EXPECT_THAT(open.notes(), HasSubstr("25 frames a second in place of 50"));
}

TEST(V4l2Open, CallsInTheWrongOrderAreRefused) {
  const UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  test::RecordingSink sink;
  const auto camera = test::make_camera("");
  ASSERT_TRUE(camera.ok());
  EXPECT_EQ((*camera)->start(sink).code(), StatusCode::failed_precondition);
  ASSERT_TRUE((*camera)->open().ok());
  EXPECT_EQ((*camera)->open().status().code(), StatusCode::failed_precondition);
  ASSERT_TRUE((*camera)->start(sink).ok());
  EXPECT_EQ((*camera)->start(sink).code(), StatusCode::failed_precondition);
}

TEST(V4l2Controls, AutomaticControlsAreOffAndValuesAreReadBack) {
  UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  const OpenCamera open("&exposure=2ms&white_balance=5003&power_line=50hz");
  EXPECT_EQ(plugged.device().control(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(plugged.device().control(V4L2_CID_EXPOSURE_ABSOLUTE), 20);
  EXPECT_EQ(plugged.device().control(V4L2_CID_EXPOSURE_AUTO_PRIORITY), 0);
  EXPECT_EQ(plugged.device().control(V4L2_CID_AUTO_WHITE_BALANCE), 0);
  EXPECT_EQ(plugged.device().control(V4L2_CID_WHITE_BALANCE_TEMPERATURE), 5000);
  EXPECT_EQ(plugged.device().control(V4L2_CID_POWER_LINE_FREQUENCY), 1);
  EXPECT_EQ(plugged.device().control(V4L2_CID_GAIN), 10) << "the lowest";
  EXPECT_THAT(open.info.exposure_s, ElementsAre(::testing::DoubleNear(0.002, 1e-12)));
  EXPECT_THAT(open.notes(), HasSubstr("white balance 5000 (asked for 5003)"));
  EXPECT_THAT(open.notes(), HasSubstr("gain 10"));
}

TEST(V4l2Controls, TheDefaultExposureIsTheCurrentOne) {
  const UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  const OpenCamera open("&gain_raw=20");
  EXPECT_THAT(open.info.exposure_s, ElementsAre(::testing::DoubleNear(0.01, 1e-12)));
  EXPECT_THAT(open.notes(), HasSubstr("gain 20"));
}

TEST(V4l2Controls, UnavailableExposuresAreNotedAndTheActualOnesDeclared) {
  const UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  const OpenCamera open("&exposure=100us");
  EXPECT_THAT(open.info.exposure_s, ElementsAre(::testing::DoubleNear(0.0003, 1e-12)));
  EXPECT_THAT(open.notes(), HasSubstr("exposure 0.3 ms in place of 0.1 ms"));
}

TEST(V4l2Controls, MissingControlsAreNoted) {
  DeviceKind kind = webcam(V4L2_PIX_FMT_YUYV);
  kind.controls.clear();
  const UmockCamera plugged(kind);
  {
    OpenCamera open("");
    EXPECT_THAT(open.notes(), HasSubstr("no control of: gain, white balance"));
    EXPECT_THAT(open.notes(), HasSubstr("an assumption"));
    EXPECT_THAT(open.info.exposure_s, ElementsAre(0.02));
    ASSERT_TRUE(open.start());
    EXPECT_TRUE(open.sink.more_come(3));
  }
  const Status bracket = test::open_status("&exposure=1ms,8ms");
  EXPECT_EQ(bracket.code(), StatusCode::invalid_argument);
  EXPECT_THAT(bracket.message(), HasSubstr("no bracket"));
}

TEST(V4l2Controls, ACameraThatStaysAutomaticHasNoKnownExposure) {
  DeviceKind kind = webcam(V4L2_PIX_FMT_YUYV);
  kind.controls[V4L2_CID_EXPOSURE_AUTO].menu = {V4L2_EXPOSURE_APERTURE_PRIORITY};
  kind.controls[V4L2_CID_GAIN].read_only = true;
  const UmockCamera plugged(kind);
  const OpenCamera open("&exposure=1ms");
  EXPECT_THAT(open.notes(), HasSubstr("automatic exposure cannot be switched off"));
  EXPECT_THAT(open.notes(), HasSubstr("no control of: gain")) << "a control that cannot be set counts as missing";
}

TEST(V4l2Frames, LendTheDriversMemoryIfNoConversionIsNeeded) {
  for (const std::uint32_t fourcc : {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_NV12, V4L2_PIX_FMT_RGB24, V4L2_PIX_FMT_SBGGR10}) {
    const UmockCamera plugged(webcam(fourcc));
    OpenCamera open("");
    const int mapped = UmockCamera::mappings();
    EXPECT_GE(mapped, 1) << "the driver's buffers";
    open.sink.keep(2);
    ASSERT_TRUE(open.start());
    ASSERT_TRUE(open.sink.more_come(3));
    const std::vector<Frame> frames = open.sink.take_kept();
    std::set<int> exported;
    for (const Frame& frame : frames) {
      const auto dma = open.camera->dma_buffer(frame.views()[0]);
      ASSERT_TRUE(dma);
      EXPECT_TRUE(exported.insert(dma->fd).second) << "each buffer has its own";
      const std::size_t offset = fourcc == V4L2_PIX_FMT_SBGGR10 ? 64 * 2 + 2 : 0;
      EXPECT_EQ(dma->offset, offset);
    }
    EXPECT_EQ(exported.size(), 2U);
    EXPECT_FALSE(open.camera->dma_buffer(View{}));
  }
}

TEST(V4l2Frames, AreConvertedOtherwise) {
  struct {
    std::uint32_t fourcc;
    PixelFormat format;
    std::vector<unsigned> first;
  } const cases[] = {
      // An exposure of 1 ms of a scene with level 400/s: red 0.4 of full scale, green half and blue a quarter of it.
      {V4L2_PIX_FMT_MJPEG, PixelFormat::rgb8, {102, 102, 102}},
      {V4L2_PIX_FMT_GREY, PixelFormat::rgb8, {102, 102, 102}},
      {V4L2_PIX_FMT_RGB24, PixelFormat::rgb8, {102, 51, 26}},
      {V4L2_PIX_FMT_YUYV, PixelFormat::yuyv, {16 + 88, 128, 16 + 88}},
      {V4L2_PIX_FMT_SRGGB8, PixelFormat::bayer_rggb8, {102, 51, 51, 26}},
      {V4L2_PIX_FMT_SGRBG8, PixelFormat::bayer_rggb8, {102, 51, 51, 26}},
      {V4L2_PIX_FMT_SGBRG8, PixelFormat::bayer_rggb8, {102, 51, 51, 26}},
      {V4L2_PIX_FMT_SBGGR8, PixelFormat::bayer_rggb8, {102, 51, 51, 26}},
      {V4L2_PIX_FMT_SRGGB10, PixelFormat::bayer_rggb10, {409, 205, 205, 102}},
      {V4L2_PIX_FMT_SGRBG12, PixelFormat::bayer_rggb12, {1638, 819, 819, 410}},
      {V4L2_PIX_FMT_SGBRG10P, PixelFormat::bayer_rggb10, {409, 205, 205, 102}},
      {V4L2_PIX_FMT_SBGGR12P, PixelFormat::bayer_rggb12, {1638, 819, 819, 410}},
  };
  for (const auto& c : cases) {
    DeviceKind kind = webcam(c.fourcc);
    kind.scene = 400;
    const UmockCamera plugged(kind);
    OpenCamera open("&exposure=1ms");
    EXPECT_EQ(open.info.format, c.format);
    ASSERT_TRUE(open.start());
    ASSERT_TRUE(open.sink.more_come(2));
    const std::vector<unsigned> corner = open.sink.seen().back().first_pixels;
    ASSERT_EQ(corner.size(), c.first.size());
    for (std::size_t i = 0; i < corner.size(); ++i)
      EXPECT_NEAR(corner[i], c.first[i], 1) << c.fourcc << " number " << i;
  }
}

TEST(V4l2Frames, HaveNoDmaBufferIfConvertedOrNotExported) {
  for (const bool exports : {false, true}) {
    DeviceKind kind = webcam(exports ? V4L2_PIX_FMT_MJPEG : V4L2_PIX_FMT_YUYV);
    kind.exports = exports;
    const UmockCamera plugged(kind);
    OpenCamera open("");
    open.sink.keep(1);
    ASSERT_TRUE(open.start());
    ASSERT_TRUE(open.sink.more_come(1));
    const std::vector<Frame> frames = open.sink.take_kept();
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_FALSE(open.camera->dma_buffer(frames[0].views()[0]));
  }
}

TEST(V4l2Frames, DamagedOnesAreCountedAndNotDelivered) {
  for (const std::uint32_t fourcc : {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_SRGGB10P}) {
    for (const bool marked : {true, false}) {
      UmockCamera plugged(webcam(fourcc));
      OpenCamera open("&exposure=5ms");
      ASSERT_TRUE(open.start());
      ASSERT_TRUE(open.sink.more_come(2));
      plugged.device().damage(5, marked);
      // On a busy machine some of the five may be dropped as late.
      ASSERT_TRUE(test::becomes_true("one is damaged", [&] { return open.camera->counts().damaged >= 1; }));
      ASSERT_TRUE(open.sink.more_come(4));
      open.camera->stop();
      const std::uint64_t damaged = open.camera->counts().damaged;
      EXPECT_LE(damaged, 5U);
      std::uint64_t missing = 0;
      const auto seen = open.sink.seen();
      for (std::size_t i = 1; i < seen.size(); ++i) {
        missing += seen[i].info.sequence - seen[i - 1].info.sequence - 1;
        EXPECT_NEAR(seen[i].level, seen[0].level, 0.03) << "half a picture";
      }
      EXPECT_GE(missing, damaged);
    }
  }
}

/// Compares mid-exposure times with the ground truth of the device.
class V4l2Times : public ::testing::TestWithParam<int> {};

TEST_P(V4l2Times, AreTheMiddleOfTheExposure) {
  DeviceKind kind = webcam(V4L2_PIX_FMT_YUYV);
  kind.stamp_flags = static_cast<std::uint32_t>(GetParam());
  kind.first_sequence = 7;
  UmockCamera plugged(kind);
  OpenCamera open("&exposure=8ms");
  // The first frames still have the previous exposure.
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(8));
  open.camera->stop();
  const bool known = (kind.stamp_flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  EXPECT_EQ(open.notes().find("timestamps are of an unknown clock") == std::string::npos, known);
  for (const auto& seen : open.sink.seen()) {
    const std::int64_t truth = plugged.device().middle_ns_of(static_cast<std::uint32_t>(seen.info.sequence) + 7);
    ASSERT_NE(truth, 0);
    // V4L2's timestamps are rounded down to microseconds. An arrival is later than the end of the frame.
    EXPECT_GE(seen.info.mid_exposure.ns, truth - 1000);
    if (known) {
      EXPECT_LE(seen.info.mid_exposure.ns, truth + 1000);
    }
    EXPECT_LE(seen.info.mid_exposure, seen.info.delivered);
  }
}

INSTANTIATE_TEST_SUITE_P(Stamps, V4l2Times,
                         ::testing::Values(V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE,
                                           V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF,
                                           V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, V4L2_BUF_FLAG_TIMESTAMP_COPY));

/// Exposure, s, from the level of a frame: uniform scene, 0.04 of full scale per millisecond, luma range 16 to 235.
double exposure_seen(const test::RecordingSink::ReceivedFrame& seen) { return (seen.level * 255 - 16) / 219 / 40; }

class V4l2BracketAfter : public ::testing::TestWithParam<int> {};

TEST_P(V4l2BracketAfter, EachFrameHasTheReportedExposure) {
  const int latch = GetParam();
  DeviceKind kind = webcam(V4L2_PIX_FMT_YUYV);
  kind.latch_frames = latch;
  const UmockCamera plugged(kind);
  OpenCamera open("&exposure=1ms,4ms,16ms");
  EXPECT_THAT(open.notes(),
              HasSubstr("a new exposure shows after " + std::to_string(latch + 1) + " frames, as measured"));
  ASSERT_EQ(open.info.exposure_s.size(), 3U);
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(40));
  open.camera->stop();
  std::set<int> places;
  for (const auto& seen : open.sink.seen()) {
    places.insert(seen.info.bracket_index);
    EXPECT_EQ(seen.info.bracket_index, static_cast<int>(seen.info.sequence % 3));
    EXPECT_EQ(seen.info.exposure_s, open.info.exposure_s[static_cast<std::size_t>(seen.info.bracket_index)]);
    EXPECT_NEAR(exposure_seen(seen), seen.info.exposure_s, 0.0003) << "frame " << seen.info.sequence;
  }
  EXPECT_EQ(places.size(), 3U);
}

INSTANTIATE_TEST_SUITE_P(Latches, V4l2BracketAfter, ::testing::Values(0, 1, 2, 4));

TEST(V4l2Bracket, ASlowSinkLosesFramesButNoFrameHasWrongMetadata) {
  const UmockCamera plugged(webcam(V4L2_PIX_FMT_YUYV));
  OpenCamera open("&exposure=1ms,8ms&control_delay=2");
  open.sink.on_frame = [n = 0](const Frame&) mutable {
    // Delays longer and shorter than a frame, in a pattern that covers all indices of the cycle.
    if (++n % 2 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(9 * (n % 9)));
  };
  ASSERT_TRUE(open.start());
  // More than the number of buffers.
  EXPECT_TRUE(test::becomes_true("thirty were late", [&] { return open.camera->counts().late >= 30; }));
  ASSERT_TRUE(open.sink.more_come(20));
  open.camera->stop();
  EXPECT_GT(open.camera->counts().wrong_exposure, 0U);
  EXPECT_EQ(open.camera->counts().disconnects, 0U) << "a buffer that is not requeued would stop the device";
  for (const auto& seen : open.sink.seen())
    EXPECT_NEAR(exposure_seen(seen), seen.info.exposure_s, 0.0003) << "frame " << seen.info.sequence;
}

TEST(V4l2Bracket, AWrongControlDelayGivesWrongExposures) {
  DeviceKind kind = webcam(V4L2_PIX_FMT_YUYV);
  kind.latch_frames = 2;
  const UmockCamera plugged(kind);
  OpenCamera open("&exposure=1ms,8ms&control_delay=2");
  ASSERT_TRUE(open.start());
  ASSERT_TRUE(open.sink.more_come(20));
  open.camera->stop();
  const auto seen = open.sink.seen();
  EXPECT_TRUE(std::ranges::any_of(seen, [](const test::RecordingSink::ReceivedFrame& s) {
    return std::abs(exposure_seen(s) - s.info.exposure_s) > 0.003;
  })) << "the true delay is three frames, the given one is two";
}

TEST(V4l2Bracket, InDarknessTheControlDelayMustBeGiven) {
  DeviceKind kind = webcam(V4L2_PIX_FMT_YUYV);
  kind.scene = 0;
  const UmockCamera plugged(kind);
  const Status s = test::open_status("&exposure=1ms,8ms");
  EXPECT_EQ(s.code(), StatusCode::unavailable);
  EXPECT_THAT(s.message(), HasSubstr("control_delay=N"));
  EXPECT_TRUE(test::open_status("&exposure=1ms,8ms&control_delay=2").ok());
}

TEST(V4l2Bracket, TheDelayIsMeasuredWithOtherExposuresIfTheBracketSaturates) {
  DeviceKind kind = webcam(V4L2_PIX_FMT_MJPEG);
  kind.scene = 1000;  // Saturated from 1 ms on; the device supports 0.3 ms.
  const UmockCamera plugged(kind);
  const OpenCamera open("&exposure=2ms,8ms");
  EXPECT_THAT(open.notes(), HasSubstr("shows after 2 frames"));
}

}  // namespace
}  // namespace lightwell
