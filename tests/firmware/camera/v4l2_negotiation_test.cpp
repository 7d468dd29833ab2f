// Tests of the choice of a mode.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "camera/backends/v4l2/formats.hpp"

namespace lightwell::v4l2 {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::uint32_t kUnknown = V4L2_PIX_FMT_H264;

Mode mode(std::uint32_t fourcc, int width, int height, std::vector<std::uint32_t> rates) {
  Mode m{fourcc, width, height, {}, false};
  for (const std::uint32_t rate : rates) m.intervals.push_back({1, rate});
  return m;
}

/// "YUYV 640x480 30"
std::string chosen(const std::vector<Mode>& modes, const RequestedFormat& wanted) {
  const Result<SelectedMode> choice = choose_mode(modes, wanted);
  if (!choice) return choice.status().message();
  return fourcc_text(choice->mode.fourcc) + " " + std::to_string(choice->mode.width) + "x" +
         std::to_string(choice->mode.height) + " " + std::to_string(std::lround(choice->interval.rate()));
}

TEST(ChooseMode, TheSizeAskedForComesFirst) {
  const std::vector<Mode> modes = {mode(V4L2_PIX_FMT_SRGGB10, 1640, 1232, {30}),
                                   mode(V4L2_PIX_FMT_YUYV, 640, 480, {30})};
  EXPECT_EQ(chosen(modes, {640, 480, 30, ""}), "YUYV 640x480 30");
}

TEST(ChooseMode, OtherwiseTheSmallestThatContainsItThenTheLargest) {
  const std::vector<Mode> modes = {mode(V4L2_PIX_FMT_YUYV, 320, 240, {30}), mode(V4L2_PIX_FMT_YUYV, 1920, 1080, {30}),
                                   mode(V4L2_PIX_FMT_YUYV, 1280, 960, {30}), mode(V4L2_PIX_FMT_YUYV, 640, 480, {30})};
  EXPECT_EQ(chosen(modes, {1000, 700, 30, ""}), "YUYV 1280x960 30");
  EXPECT_EQ(chosen(modes, {4000, 3000, 30, ""}), "YUYV 1920x1080 30");
  EXPECT_EQ(chosen(modes, {1280, 1000, 30, ""}), "YUYV 1920x1080 30")
      << "a height that is too small does not contain the wanted size";
}

TEST(ChooseMode, ASufficientRateComesBeforeAPreferredFormat) {
  const std::vector<Mode> modes = {mode(V4L2_PIX_FMT_YUYV, 1280, 960, {5, 7}),
                                   mode(V4L2_PIX_FMT_MJPEG, 1280, 960, {15, 30})};
  EXPECT_EQ(chosen(modes, {1280, 960, 30, ""}), "MJPG 1280x960 30");
  EXPECT_EQ(chosen(modes, {1280, 960, 6, ""}), "YUYV 1280x960 7");
  EXPECT_EQ(chosen(modes, {1280, 960, 60, ""}), "YUYV 1280x960 7")
      << "if no rate is sufficient, the preference decides";
}

TEST(ChooseMode, ThirtyMatches29Point97) {
  Mode ntsc{V4L2_PIX_FMT_YUYV, 640, 480, {{1001, 30000}}, false};
  const std::vector<Mode> modes = {ntsc, mode(V4L2_PIX_FMT_MJPEG, 640, 480, {30})};
  EXPECT_EQ(chosen(modes, {640, 480, 30, ""}), "YUYV 640x480 30");
}

TEST(ChooseMode, FollowsTheOrderOfEncodings) {
  std::vector<Mode> modes;
  for (const Encoding& encoding : encodings()) modes.insert(modes.begin(), mode(encoding.fourcc, 640, 480, {30}));
  std::vector<std::string_view> order;
  while (!modes.empty()) {
    const Result<SelectedMode> choice = choose_mode(modes, {640, 480, 30, ""});
    ASSERT_TRUE(choice.ok());
    const std::string_view name = encoding_of(choice->mode.fourcc)->name;
    if (order.empty() || order.back() != name) order.push_back(name);
    std::erase_if(modes, [&](const Mode& m) { return m.fourcc == choice->mode.fourcc; });
  }
  EXPECT_THAT(order, ::testing::ElementsAre("bayer12", "bayer10", "bayer8", "rgb8", "yuyv", "nv12", "mjpeg", "grey"));
}

TEST(ChooseMode, UsesOnlyTheRequestedFormat) {
  const std::vector<Mode> modes = {mode(V4L2_PIX_FMT_YUYV, 640, 480, {30}), mode(V4L2_PIX_FMT_MJPEG, 320, 240, {15})};
  EXPECT_EQ(chosen(modes, {640, 480, 30, "mjpeg"}), "MJPG 320x240 15");
  const std::string none = chosen(modes, {640, 480, 30, "nv12"});
  EXPECT_THAT(none, HasSubstr("format=nv12"));
  EXPECT_THAT(none, HasSubstr("MJPG, YUYV"));
}

TEST(ChooseMode, IgnoresUnsupportedFormats) {
  EXPECT_EQ(chosen({mode(kUnknown, 640, 480, {30}), mode(V4L2_PIX_FMT_GREY, 64, 48, {5})}, {640, 480, 30, ""}),
            "GREY 64x48 5");
  EXPECT_THAT(chosen({mode(kUnknown, 640, 480, {30})}, {}), HasSubstr("H264, of which nothing can be read"));
  EXPECT_THAT(chosen({}, {}), HasSubstr("offers nothing"));
}

TEST(ChooseMode, SupportsContinuousRates) {
  Mode any{V4L2_PIX_FMT_YUYV, 640, 480, {{1, 5}, {1, 60}}, true};
  EXPECT_EQ(chosen({any}, {640, 480, 24, ""}), "YUYV 640x480 24");
  EXPECT_EQ(chosen({any}, {640, 480, 90, ""}), "YUYV 640x480 60");
  EXPECT_EQ(chosen({any}, {640, 480, 1, ""}), "YUYV 640x480 5");
}

TEST(ChooseMode, AcceptsADeviceWithUnknownRates) {
  EXPECT_EQ(chosen({mode(V4L2_PIX_FMT_YUYV, 640, 480, {})}, {640, 480, 30, ""}), "YUYV 640x480 0");
}

TEST(NearestIn, StaysInTheRangeAndOnItsSteps) {
  const StepRange range{10, 100, 20};  // 10, 30, 50, 70, 90
  EXPECT_EQ(nearest_in(range, -5), 10);
  EXPECT_EQ(nearest_in(range, 19), 10);
  EXPECT_EQ(nearest_in(range, 20), 30);
  EXPECT_EQ(nearest_in(range, 55), 50);
  EXPECT_EQ(nearest_in(range, 100), 90);
  EXPECT_EQ(nearest_in(range, 1 << 30), 90);
  EXPECT_EQ(nearest_in({5, 5, 1}, 7), 5);
  EXPECT_EQ(nearest_in({5, 3, 1}, 7), 5) << "invalid range";
  EXPECT_EQ(nearest_in({0, 10, 0}, 7), 7) << "a driver without a step";
  EXPECT_EQ(nearest_in({-2000000000, 2000000000, 1}, 2000000000), 2000000000);
}

}  // namespace
}  // namespace lightwell::v4l2
