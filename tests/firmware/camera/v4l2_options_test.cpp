// Tests of the URI parameters of V4L2 cameras.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "camera/backends/v4l2/options.hpp"

namespace lightwell::v4l2 {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

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
  config.exposure_s = {0.001, 0.008};
  const Result<Options> plain = parsed("v4l2:/dev/video2", config);
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->path, "/dev/video2");
  EXPECT_EQ(plain->wanted.width, 1280);
  EXPECT_EQ(plain->wanted.height, 960);
  EXPECT_EQ(plain->wanted.rate, 25);
  EXPECT_THAT(plain->exposure_s, ElementsAre(0.001, 0.008));
  config.exposure_s.clear();
  const Result<Options> said = parsed(
      "v4l2:/dev/v4l/by-id/usb-Cam-video-index0?width=320&height=240&fps=59.94&format=mjpeg&exposure=500us,2ms,0.01s"
      "&gain=16&white_balance=4600&power_line=50hz&readout=14.8us&control_delay=3",
      config);
  ASSERT_TRUE(said.ok()) << said.status().message();
  EXPECT_EQ(said->path, "/dev/v4l/by-id/usb-Cam-video-index0");
  EXPECT_EQ(said->wanted.width, 320);
  EXPECT_EQ(said->wanted.height, 240);
  EXPECT_EQ(said->wanted.rate, 59.94);
  EXPECT_EQ(said->wanted.format, "mjpeg");
  EXPECT_THAT(said->exposure_s,
              ElementsAre(::testing::DoubleNear(0.0005, 1e-12), ::testing::DoubleNear(0.002, 1e-12), 0.01));
  EXPECT_EQ(said->gain, 16);
  EXPECT_EQ(said->white_balance_kelvin, 4600);
  EXPECT_EQ(said->power_line, 1);
  EXPECT_EQ(said->row_readout.ns, 14'800);
  EXPECT_EQ(said->control_delay, 3);
}

TEST(V4l2Options, SuggestTheNearestNameForAMisspeltOne) {
  EXPECT_THAT(refusal("v4l2:/dev/video0?widht=640"), HasSubstr("did you mean 'width'?"));
  EXPECT_THAT(refusal("v4l2:/dev/video0?exposre=1ms"), HasSubstr("did you mean 'exposure'?"));
  EXPECT_THAT(refusal("v4l2:/dev/video0?readuot=1us"), HasSubstr("did you mean 'readout'?"));
}

TEST(V4l2Options, WithInvalidValuesAreNamed) {
  for (const auto* const bad :
       {"width=0",       "width=",          "width=640px",      "height=-480",      "fps=0",
        "fps=nan",       "fps=1e9",         "format=yuv",       "exposure=",        "exposure=0",
        "exposure=1ms,", "exposure=-1ms",   "exposure=inf",     "exposure=90s",     "exposure=3 ms",
        "gain=high",     "gain=1.5",        "white_balance=0",  "power_line=auto",  "readout=-1us",
        "readout=nanus", "control_delay=0", "control_delay=31", "control_delay=2.5"}) {
    const std::string message = refusal(std::string("v4l2:/dev/video0?") + bad);
    EXPECT_THAT(message, HasSubstr(std::string(bad).substr(0, std::string(bad).find('=')) + ":")) << bad;
  }
  EXPECT_THAT(refusal("v4l2:/dev/video0?format=yuv"),
              HasSubstr("bayer12, bayer10, bayer8, rgb8, yuyv, nv12, mjpeg, grey"));
}

TEST(V4l2Options, ForExposuresAndGainMustBeGivenOnce) {
  CameraConfig config;
  config.exposure_s = {0.001};
  EXPECT_THAT(refusal("v4l2:/dev/video0?exposure=1ms", config), HasSubstr("leave one of them out"));
  config.exposure_s.assign(9, 0.001);
  EXPECT_THAT(refusal("v4l2:/dev/video0", config), HasSubstr("1 to 8 exposures, not 9"));
  config.exposure_s = {std::nan("")};
  EXPECT_THAT(refusal("v4l2:/dev/video0", config), HasSubstr("above zero"));
  config.exposure_s.clear();
  config.gain = 4;
  EXPECT_THAT(refusal("v4l2:/dev/video0", config), HasSubstr("gain="));
  EXPECT_THAT(refusal("v4l2:"), HasSubstr("/dev/video0"));
}

}  // namespace
}  // namespace lightwell::v4l2
