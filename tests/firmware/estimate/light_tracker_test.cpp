#include "estimate/common/light_tracker.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

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

/// Frames at a constant rate.
class Clip {
 public:
  explicit Clip(double rate = 30) : frame_ns_(static_cast<std::int64_t>(1e9 / rate)) {}
  void frame(std::vector<Light>& lights) { tracker_.assign(lights, {++frames_ * frame_ns_}); }

 private:
  LightTracker tracker_;
  std::int64_t frame_ns_, frames_ = 0;
};

TEST(LightTracker, KeepsTracksOfMovingLightsInAnyOrder) {
  Clip clip;
  std::vector<Light> lights = {towards(0), towards(90), towards(180)};
  clip.frame(lights);
  const auto a = lights[0].track, b = lights[1].track, c = lights[2].track;
  EXPECT_TRUE(a != 0 && b != 0 && c != 0 && a != b && b != c && a != c);
  for (int frame = 1; frame <= 60; ++frame) {
    lights = {towards(180 + frame), towards(0 + frame), towards(90 + frame)};
    clip.frame(lights);
    ASSERT_EQ(lights[0].track, c);
    ASSERT_EQ(lights[1].track, a);
    ASSERT_EQ(lights[2].track, b);
  }
}

TEST(LightTracker, KeepsATrackForOneSecondAtAnyFrameRate) {
  for (const double rate : {30.0, 4.6}) {
    Clip clip(rate);
    std::vector<Light> lights = {towards(30)}, none;
    clip.frame(lights);
    const auto track = lights[0].track;
    const int in_a_second = static_cast<int>(rate);
    for (int i = 0; i < in_a_second; ++i) clip.frame(none);
    lights = {towards(30)};
    clip.frame(lights);
    EXPECT_EQ(lights[0].track, track) << rate << " frames/s";
    for (int i = 0; i < in_a_second + 1; ++i) clip.frame(none);
    lights = {towards(30)};
    clip.frame(lights);
    EXPECT_NE(lights[0].track, track) << rate << " frames/s";
  }
}

TEST(LightTracker, FollowsARotatingProbeAtAnyFrameRate) {
  // 90 deg/s: 3 or 20 degrees per frame.
  for (const double rate : {30.0, 4.6}) {
    Clip clip(rate);
    std::uint32_t first = 0, second = 0;
    for (int frame = 0; frame < 40; ++frame) {
      const double at = 90 / rate * frame;
      std::vector<Light> lights = {towards(at), towards(at + 60)};
      clip.frame(lights);
      if (frame == 0) first = lights[0].track, second = lights[1].track;
      ASSERT_EQ(lights[0].track, first) << rate << " frames/s, frame " << frame;
      ASSERT_EQ(lights[1].track, second) << rate << " frames/s, frame " << frame;
    }
  }
}

TEST(LightTracker, KeepsTracksWhereTimeStandsStillOrRunsBackwards) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  LightTracker tracker;
  std::vector<Light> lights = {towards(0), towards(90)}, none;
  tracker.assign(lights, {100 * kSecond});
  const auto a = lights[0].track, b = lights[1].track;
  const auto expect_kept = [&](std::int64_t ns, const char* what) {
    lights = {towards(90.5), towards(0.5)};
    tracker.assign(lights, {ns});
    EXPECT_EQ(lights[0].track, b) << what;
    EXPECT_EQ(lights[1].track, a) << what;
  };
  expect_kept(100 * kSecond, "time stands still");
  expect_kept(3 * kSecond, "the clock was restarted");
  expect_kept(std::numeric_limits<std::int64_t>::min(), "smallest time");
  expect_kept(std::numeric_limits<std::int64_t>::max(), "largest time, lamps have not moved");
  for (int i = 0; i < 100; ++i) tracker.assign(none, {50 * kSecond - i * kSecond});
  expect_kept(-60 * kSecond, "lamps are off while time runs backwards");
}

TEST(LightTracker, ANewLightGetsANewTrack) {
  Clip clip;
  std::vector<Light> lights = {towards(0)};
  clip.frame(lights);
  const auto first = lights[0].track;
  lights = {towards(0), towards(20)};
  clip.frame(lights);
  EXPECT_EQ(lights[0].track, first);
  EXPECT_NE(lights[1].track, first);
}

TEST(LightTracker, TheNearerLightKeepsTheTrack) {
  Clip clip;
  std::vector<Light> lights = {towards(0)};
  clip.frame(lights);
  const auto first = lights[0].track;
  lights = {towards(5), towards(1)};
  clip.frame(lights);
  EXPECT_EQ(lights[1].track, first);
}

TEST(LightTracker, KeepsTracksOfTwoLightsThatCrossAndMerge) {
  const auto lit = [](double azimuth_deg, float strength) {
    Light l = towards(azimuth_deg);
    l.irradiance = {strength, strength, strength};
    return l;
  };
  for (const float other : {1.0F, 1.5F, 4.0F}) {
    Clip clip;
    std::vector<Light> lights;
    std::uint32_t right = 0, left = 0;
    for (int frame = -40; frame <= 40; ++frame) {
      const double at = 0.5 * frame;
      lights = {lit(at, 1), lit(-at, other)};
      // Closer than 3 degrees, they are detected as one light at the centroid.
      if (std::abs(2 * at) < 3) lights = {lit(at * (1 - other) / (1 + other), 1 + other)};
      clip.frame(lights);
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

TEST(LightTracker, HandlesManyAppearingAndDisappearingLights) {
  Clip clip;
  std::vector<Light> lights;
  for (int frame = 0; frame < 500; ++frame) {
    lights.clear();
    for (int i = 0; i < 64; ++i) lights.push_back(towards(i * 5.6 + frame * 37.0, i % 7 - 3));
    clip.frame(lights);
    for (const Light& l : lights) ASSERT_NE(l.track, 0U);
  }
}

}  // namespace
}  // namespace lightwell::estimate
