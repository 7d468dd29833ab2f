#include "imaging/uri.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lightwell {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;

TEST(CameraUri, PartsComeInTheOrderWritten) {
  const auto uri = parse_camera_uri("sim:/a b/city.exr?rig=pair&frames=8&empty=");
  ASSERT_TRUE(uri.ok()) << uri.status().message();
  EXPECT_EQ(uri->scheme, "sim");
  EXPECT_EQ(uri->path, "/a b/city.exr");
  EXPECT_THAT(uri->parameters, ::testing::ElementsAre(Pair("rig", "pair"), Pair("frames", "8"), Pair("empty", "")));
}

TEST(CameraUri, PathMayHoldColonsAndMayBeEmpty) {
  EXPECT_EQ(parse_camera_uri("v4l2:/dev/v4l/by-id/usb-046d:0825")->path, "/dev/v4l/by-id/usb-046d:0825");
  EXPECT_EQ(parse_camera_uri("libcamera:")->path, "");
  EXPECT_EQ(parse_camera_uri("replay:a?loop=1=2")->parameters[0].second, "1=2");
}

TEST(CameraUri, InvalidUrisAreRefusedAndQuoted) {
  for (const char* text : {"", "room.lwrec", ":path", "SIM:x", "a b:x", "sim:x?", "sim:x?rig", "sim:x?=3", "sim:x?a=1&",
                           "sim:x?a=1&&b=2", "sim:x?a=1&a=2"}) {
    const auto uri = parse_camera_uri(text);
    ASSERT_FALSE(uri.ok()) << text;
    EXPECT_EQ(uri.status().code(), StatusCode::invalid_argument);
    EXPECT_THAT(uri.status().message(), HasSubstr(text));
  }
}

TEST(CameraUri, SuggestsANameOnlyWithinTheEditDistance) {
  EXPECT_EQ(nearest_name("lop", {"loop", "pace"}), "loop");
  EXPECT_EQ(nearest_name("pase", {"loop", "pace"}), "pace");
  EXPECT_EQ(nearest_name("exposure_times", {"exposure_time", "x"}), "exposure_time");
  EXPECT_EQ(nearest_name("brightness", {"loop", "pace"}), "");
  EXPECT_EQ(nearest_name("xy", {"ab"}), "");
  EXPECT_EQ(nearest_name("", {"a"}), "");
  EXPECT_EQ(nearest_name("a", {}), "");
}

TEST(CameraUri, AnUnknownParameterIsNamedWithTheNearest) {
  const auto uri = parse_camera_uri("replay:x?loop=2&pase=fast");
  ASSERT_TRUE(uri.ok());
  EXPECT_TRUE(check_parameters(*uri, {"loop", "pase"}).ok());
  const Status status = check_parameters(*uri, {"loop", "pace"});
  EXPECT_EQ(status.code(), StatusCode::invalid_argument);
  EXPECT_THAT(status.message(), HasSubstr("'pase'"));
  EXPECT_THAT(status.message(), HasSubstr("did you mean 'pace'?"));
  EXPECT_THAT(check_parameters(*uri, {}).message(), Not(HasSubstr("did you mean")));
}

TEST(CameraUri, FormerNamesOfParametersAreReplacedWithAWarning) {
  auto uri = parse_camera_uri("replay:x?repeat=2&pace=fast");
  ASSERT_TRUE(uri.ok());
  std::vector<std::string> warnings;
  ASSERT_TRUE(rename_parameters(*uri, {{"speed", "pace"}, {"repeat", "loop"}}, warnings).ok());
  EXPECT_THAT(uri->parameters, ::testing::ElementsAre(Pair("loop", "2"), Pair("pace", "fast")));
  EXPECT_THAT(warnings, ::testing::ElementsAre(HasSubstr("'repeat' is now called 'loop'")));
  const Status both = rename_parameters(*uri, {{"loop", "pace"}}, warnings);
  EXPECT_EQ(both.code(), StatusCode::invalid_argument);
  EXPECT_THAT(both.message(), HasSubstr("leave 'loop' out"));
}

}  // namespace
}  // namespace lightwell
