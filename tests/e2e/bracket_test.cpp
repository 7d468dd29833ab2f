// Exposure brackets: an 8-bit camera in a scene with a lamp that is 2,000 times brighter than the walls.
#include <cmath>

#include <gtest/gtest.h>

#include "e2e/daemon.hpp"
#include "e2e/light_truth.hpp"

namespace lightwell::test {
namespace {

/// Exposure times in seconds. In one second a radiance of 0.01 saturates. The first does not clip the lamp, the last
/// exposes the walls well.
const std::vector<double> kBracket = {0.000008, 0.00028, 0.01};

class BracketTest : public ::testing::Test {
 protected:
  BracketTest()
      : room_(test::room(128,
                         [](Vec3d) {
                           return Radiance{0.5F, 0.5F, 0.5F};
                         },
                         {{{1, 0, 0}, 6 * kDegree, {1000, 1000, 1000}}})) {
    write_exr(folder_.path("room.exr"), room_);
  }
  [[nodiscard]] std::string camera() const { return "sim:" + folder_.path("room.exr") + "?sensor=rgb8"; }

  const PanoramaPixels room_;
  TempDir folder_;
};

TEST_F(BracketTest, ThreeExposuresCoverTheDynamicRange) {
  const LightTruth truth(room_);
  Daemon daemon({.camera = camera(), .frame_rate = 60, .exposure_s = kBracket});
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(3)) << daemon.process().err();
  const Lighting light = observer.probe().latest();
  EXPECT_FALSE(light.descriptor().flags.has(Flag::clipped));
  EXPECT_EQ(light.descriptor().saturated, 0.0F);
  EXPECT_EQ(light.units(), Units::absolute);
  const double error = truth.error_of(light).rms;
  EXPECT_LE(error, 0.03);
  EXPECT_LE(error, static_cast<double>(light.descriptor().bound.total));
  const std::optional<Light> lamp = light.primary_light();
  ASSERT_TRUE(lamp);
  EXPECT_LT(angle_between(vec_cast<double>(lamp->direction), Vec3d{1, 0, 0}), 0.5 * kDegree);
}

TEST_F(BracketTest, ABracketIsOneCaptureAndLeavesNoGap) {
  Daemon daemon({.camera = camera(), .frame_rate = 30, .exposure_s = kBracket});
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(20)) << daemon.process().err();
  const std::vector<Descriptor> all = observer.descriptors();
  // Sequence numbers count captures, not frames. Frames lost on a busy machine cannot amount to two of three in every
  // bracket.
  EXPECT_LT(all.back().sequence - all.front().sequence, 2 * all.size());
}

TEST_F(BracketTest, OneExposureIsFlaggedAndItsBoundIsInfinite) {
  Daemon daemon({.camera = camera()});
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(1)) << daemon.process().err();
  const Descriptor d = observer.probe().latest().descriptor();
  EXPECT_TRUE(d.flags.has(Flag::clipped));
  EXPECT_TRUE(std::isinf(d.bound.total));
  EXPECT_GT(d.saturated, 0.0F);
}

}  // namespace
}  // namespace lightwell::test
