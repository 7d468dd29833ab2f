// Tests of the URI parameters of V4L2 cameras.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "camera/backends/v4l2/connection.hpp"

namespace lightwell::v4l2 {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Result<Options> parsed(const std::string& text, const CameraConfig& config = {}) {
  const Result<CameraUri> uri = parse_camera_uri(text);
  if (!uri) return uri.status();
  return parse_options(*uri, config);
}

std::string refusal(const std::string& text, const CameraConfig& config = {}) {
  const Result<Options> options = parsed(text, config);
  EXPECT_FALSE(options.ok()) << text;
  EXPECT_EQ(options.status().code(), StatusCode::invalid_argument);
  return options.status().message();
}

TEST(V4l2Options, OfTheUriOverrideTheConfiguration) {
  CameraConfig config;
  config.width = 1280;
  config.height = 960;
  config.frame_rate = 25;
  config.capture.exposure_s = {0.001, 0.008};
  const Result<Options> plain = parsed("v4l2:/dev/video2", config);
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->path, "/dev/video2");
  EXPECT_EQ(plain->wanted.width, 1280);
  EXPECT_EQ(plain->wanted.height, 960);
  EXPECT_EQ(plain->wanted.rate, 25);
  EXPECT_THAT(plain->capture.exposure_s, ElementsAre(0.001, 0.008));
  config.capture.exposure_s.clear();
  const Result<Options> said = parsed(
      "v4l2:/dev/v4l/by-id/usb-Cam-video-index0?width=320&height=240&frame_rate=59.94&format=mjpeg"
      "&exposure=500us,2ms,0.01s&gain_raw=16&white_balance=4600K&power_line=50hz&row_readout=14.8us&control_delay=3",
      config);
  ASSERT_TRUE(said.ok()) << said.status().message();
  EXPECT_EQ(said->path, "/dev/v4l/by-id/usb-Cam-video-index0");
  EXPECT_EQ(said->wanted.width, 320);
  EXPECT_EQ(said->wanted.height, 240);
  EXPECT_EQ(said->wanted.rate, 59.94);
  EXPECT_EQ(said->wanted.format, "mjpeg");
  EXPECT_THAT(said->capture.exposure_s,
              ElementsAre(::testing::DoubleNear(0.0005, 1e-12), ::testing::DoubleNear(0.002, 1e-12), 0.01));
  EXPECT_EQ(said->gain_raw, 16);
  EXPECT_EQ(said->capture.white_balance_k, 4600);
  EXPECT_EQ(said->power_line, 1);
  EXPECT_EQ(said->row_readout.ns, 14'800);
  EXPECT_EQ(said->control_delay, 3);
  EXPECT_THAT(said->notes, IsEmpty());
}

TEST(V4l2Options, FormerNamesAreAcceptedWithANote) {
  const Result<Options> options = parsed("v4l2:/dev/video0?fps=59.94&gain=16&readout=14.8us&white_balance=4600");
  ASSERT_TRUE(options.ok()) << options.status().message();
  EXPECT_EQ(options->wanted.rate, 59.94);
  EXPECT_EQ(options->gain_raw, 16);
  EXPECT_EQ(options->row_readout.ns, 14'800);
  EXPECT_EQ(options->capture.white_balance_k, 4600) << "a bare number is kelvin";
  EXPECT_THAT(options->notes,
              ElementsAre(HasSubstr("'fps' is now called 'frame_rate'"), HasSubstr("'gain' is now called 'gain_raw'"),
                          HasSubstr("'readout' is now called 'row_readout'")));
  EXPECT_THAT(refusal("v4l2:/dev/video0?fps=30&frame_rate=30"), HasSubstr("leave 'fps' out"));
}

TEST(V4l2Options, SuggestTheNearestNameForAMisspeltOne) {
  EXPECT_THAT(refusal("v4l2:/dev/video0?widht=640"), HasSubstr("did you mean 'width'?"));
  EXPECT_THAT(refusal("v4l2:/dev/video0?exposre=1ms"), HasSubstr("did you mean 'exposure'?"));
  EXPECT_THAT(refusal("v4l2:/dev/video0?row_readuot=1us"), HasSubstr("did you mean 'row_readout'?"));
}

TEST(V4l2Options, WithInvalidValuesAreNamed) {
  for (const auto* const bad :
       {"width=0",           "width=",          "width=640px",      "height=-480",      "frame_rate=0",
        "frame_rate=nan",    "frame_rate=1e9",  "format=yuv",       "exposure=",        "exposure=0",
        "exposure=1ms,",     "exposure=-1ms",   "exposure=inf",     "exposure=90s",     "exposure=3 ms",
        "gain_raw=high",     "gain_raw=1.5",    "white_balance=0",  "power_line=auto",  "row_readout=-1us",
        "row_readout=nanus", "control_delay=0", "control_delay=31", "control_delay=2.5"}) {
    const std::string message = refusal(std::string("v4l2:/dev/video0?") + bad);
    EXPECT_THAT(message, HasSubstr(std::string(bad).substr(0, std::string(bad).find('=')) + ":")) << bad;
  }
  EXPECT_THAT(refusal("v4l2:/dev/video0?format=yuv"),
              HasSubstr("bayer12, bayer10, bayer8, rgb8, yuyv, nv12, mjpeg, grey"));
}

TEST(V4l2Options, ForExposuresAndGainMustBeGivenOnce) {
  CameraConfig config;
  config.capture.exposure_s = {0.001};
  EXPECT_THAT(refusal("v4l2:/dev/video0?exposure=1ms", config), HasSubstr("leave one of them out"));
  config.capture.exposure_s.assign(9, 0.001);
  EXPECT_THAT(refusal("v4l2:/dev/video0", config), HasSubstr("1 to 8 exposures, not 9"));
  config.capture.exposure_s = {std::nan("")};
  EXPECT_THAT(refusal("v4l2:/dev/video0", config), HasSubstr("above zero"));
  config.capture = {.gain = 4};
  EXPECT_THAT(refusal("v4l2:/dev/video0", config), ::testing::AllOf(HasSubstr("camera.gain"), HasSubstr("gain_raw")));
  EXPECT_THAT(refusal("v4l2:"), HasSubstr("/dev/video0"));
}

}  // namespace
}  // namespace lightwell::v4l2
