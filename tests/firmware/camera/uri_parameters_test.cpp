// Tests of read_parameters(): settings from the URI and from the configuration.
#include "camera/uri_parameters.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lightwell {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

const ParameterNames kNames = {.capture = {"exposure", "gain", "white_balance", "colour_gains"},
                               .own = {"format"},
                               .renamed = {{"white", "white_balance"}}};

Result<UriParameters> parsed(const std::string& query, const CaptureSettings& capture = {},
                             const ParameterNames& names = kNames) {
  CameraConfig config;
  config.capture = capture;
  return read_parameters(*parse_camera_uri("cam:x?" + query), config, names);
}

std::string refusal(const std::string& query, const CaptureSettings& capture = {}) {
  const Status s = parsed(query, capture).status();
  EXPECT_EQ(s.code(), StatusCode::invalid_argument) << query;
  return s.message();
}

TEST(UriParameters, OfTheUriAndOfTheConfigurationMeanTheSame) {
  const CaptureSettings settings{.exposure_s = {0.001, 0.008},
                                 .gain = 2,
                                 .white_balance_k = 4600,
                                 .colour_gains = std::array<double, 2>{1.8, 1.5}};
  const std::string query = "exposure=1ms,8ms&gain=2&white_balance=4600K&colour_gains=1.8,1.5";
  for (const Result<UriParameters>& p : {parsed(query + "&format=nv12"), parsed("format=nv12", settings)}) {
    ASSERT_TRUE(p.ok()) << p.status().message();
    EXPECT_THAT(p->capture.exposure_s, ElementsAre(0.001, 0.008));
    EXPECT_EQ(p->capture.gain, 2);
    EXPECT_EQ(p->capture.white_balance_k, 4600);
    EXPECT_EQ(p->capture.colour_gains, settings.colour_gains);
    EXPECT_THAT(p->own, ElementsAre(Pair("format", "nv12")));
    EXPECT_THAT(p->warnings, IsEmpty());
  }
  const Result<UriParameters> bare = parsed("exposure=0.001,0.008&white_balance=4600");
  ASSERT_TRUE(bare.ok()) << bare.status().message();
  EXPECT_THAT(bare->capture.exposure_s, ElementsAre(0.001, 0.008)) << "a bare number is seconds";
  EXPECT_EQ(bare->capture.white_balance_k, 4600) << "a bare number is kelvin";
}

TEST(UriParameters, NothingIsSetByDefault) {
  const Result<UriParameters> p = parsed("format=nv12");
  ASSERT_TRUE(p.ok());
  EXPECT_THAT(p->capture.exposure_s, IsEmpty());
  EXPECT_FALSE(p->capture.gain.has_value());
  EXPECT_FALSE(p->capture.white_balance_k.has_value());
  EXPECT_FALSE(p->capture.colour_gains.has_value());
}

TEST(UriParameters, GivenTwiceAreRefused) {
  EXPECT_THAT(refusal("exposure=1ms", {.exposure_s = {0.001}}), HasSubstr("camera.exposure_s: leave one of them out"));
  EXPECT_THAT(refusal("gain=2", {.gain = 2}), HasSubstr("camera.gain: leave one of them out"));
  EXPECT_THAT(refusal("white=5000K", {.white_balance_k = 5000}),
              HasSubstr("camera.white_balance_k: leave one of them out"));
}

TEST(UriParameters, ThatTheCameraDoesNotHaveAreRefusedByName) {
  const ParameterNames none = {.capture = {}, .own = {"format"}, .renamed = {}};
  for (const char* query : {"exposure=1ms", "gain=2", "white_balance=5000K", "colour_gains=1,1"}) {
    const std::string name = std::string(query).substr(0, std::string(query).find('='));
    EXPECT_THAT(parsed(query, {}, none).status().message(), HasSubstr("no parameter '" + name + "'"));
  }
  EXPECT_THAT(parsed("format=nv12", {.exposure_s = {1}}, none).status().message(),
              HasSubstr("camera.exposure_s: this camera has no exposure"));
  EXPECT_THAT(parsed("format=nv12", {.colour_gains = std::array<double, 2>{1, 1}}, none).status().message(),
              HasSubstr("camera.colour_gains: this camera has no colour_gains"));
}

TEST(UriParameters, InvalidValuesAreNamed) {
  for (const char* bad :
       {"exposure=", "exposure=1ms,", "exposure=-1ms", "gain=0", "gain=x", "gain=1K", "white_balance=900",
        "white_balance=5000C", "white_balance=20001K", "colour_gains=1", "colour_gains=1,2,3", "colour_gains=1,0"}) {
    const std::string text(bad);
    EXPECT_THAT(refusal(text), HasSubstr("cam: " + text.substr(0, text.find('=')) + ": ")) << text;
  }
}

TEST(UriParameters, FormerNamesAreAcceptedWithAWarning) {
  const Result<UriParameters> p = parsed("white=4200K");
  ASSERT_TRUE(p.ok()) << p.status().message();
  EXPECT_EQ(p->capture.white_balance_k, 4200);
  EXPECT_THAT(p->warnings, ElementsAre(HasSubstr("'white' is now called 'white_balance'")));
}

}  // namespace
}  // namespace lightwell
