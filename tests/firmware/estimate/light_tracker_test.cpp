#include "estimate/common/light_tracker.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace lightwell::estimate {
namespace {

Light towards(double azimuth_deg, double height = 0) {
  const double a = azimuth_deg * 3.14159265358979 / 180;
  Light l;
  l.direction =
      normalized(Vec3f{static_cast<float>(std::sin(a)), static_cast<float>(height), static_cast<float>(-std::cos(a))});
  return l;
}

TEST(LightTracker, KeepsTheNumbersOfLampsThatMoveAndChangeOrder) {
  LightTracker tracker;
  std::vector<Light> lights = {towards(0), towards(90), towards(180)};
  tracker.assign(lights);
  const auto a = lights[0].track, b = lights[1].track, c = lights[2].track;
  EXPECT_TRUE(a != 0 && b != 0 && c != 0 && a != b && b != c && a != c);
  for (int frame = 1; frame <= 60; ++frame) {
    lights = {towards(180 + frame), towards(0 + frame), towards(90 + frame)};
    tracker.assign(lights);
    ASSERT_EQ(lights[0].track, c);
    ASSERT_EQ(lights[1].track, a);
    ASSERT_EQ(lights[2].track, b);
  }
}

TEST(LightTracker, RemembersALampThatIsOffForASecond) {
  LightTracker tracker;
  std::vector<Light> lights = {towards(30)}, none;
  tracker.assign(lights);
  const auto track = lights[0].track;
  for (int i = 0; i < 30; ++i) tracker.assign(none);
  lights = {towards(30)};
  tracker.assign(lights);
  EXPECT_EQ(lights[0].track, track);
  for (int i = 0; i < 31; ++i) tracker.assign(none);
  lights = {towards(30)};
  tracker.assign(lights);
  EXPECT_NE(lights[0].track, track);
}

TEST(LightTracker, GivesANewLampANewNumber) {
  LightTracker tracker;
  std::vector<Light> lights = {towards(0)};
  tracker.assign(lights);
  const auto first = lights[0].track;
  lights = {towards(0), towards(20)};
  tracker.assign(lights);
  EXPECT_EQ(lights[0].track, first);
  EXPECT_NE(lights[1].track, first);
}

TEST(LightTracker, LetsTheNearerOfTwoKeepTheNumber) {
  LightTracker tracker;
  std::vector<Light> lights = {towards(0)};
  tracker.assign(lights);
  const auto first = lights[0].track;
  lights = {towards(5), towards(1)};
  tracker.assign(lights);
  EXPECT_EQ(lights[1].track, first);
}

TEST(LightTracker, KeepsTheNumbersOfTwoLampsThatCrossThoughTheyAreOneForAWhile) {
  const auto lit = [](double azimuth_deg, float strength) {
    Light l = towards(azimuth_deg);
    l.irradiance = {strength, strength, strength};
    return l;
  };
  for (const float other : {1.0F, 1.5F, 4.0F}) {
    LightTracker tracker;
    std::vector<Light> lights;
    std::uint32_t right = 0, left = 0;
    for (int frame = -40; frame <= 40; ++frame) {
      const double at = 0.5 * frame;
      lights = {lit(at, 1), lit(-at, other)};
      // Closer than 3 degrees they are one spot, at the centroid.
      if (std::abs(2 * at) < 3) lights = {lit(at * (1 - other) / (1 + other), 1 + other)};
      tracker.assign(lights);
      if (frame == -40) {
        right = lights[0].track;
        left = lights[1].track;
      } else if (lights.size() == 2) {
        ASSERT_EQ(lights[0].track, right) << "frame " << frame << ", the other is " << other << " times as strong";
        ASSERT_EQ(lights[1].track, left) << "frame " << frame << ", the other is " << other << " times as strong";
      }
    }
  }
}

TEST(LightTracker, StandsManyLampsThatComeAndGoForEver) {
  LightTracker tracker;
  std::vector<Light> lights;
  for (int frame = 0; frame < 500; ++frame) {
    lights.clear();
    for (int i = 0; i < 64; ++i) lights.push_back(towards(i * 5.6 + frame * 37.0, i % 7 - 3));
    tracker.assign(lights);
    for (const Light& l : lights) ASSERT_NE(l.track, 0U);
  }
}

}  // namespace
}  // namespace lightwell::estimate
