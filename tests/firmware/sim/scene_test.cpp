// Tests of Scene: the state is a pure function of the frame index, and the cycle closes without a jump.
#include "sim/scene.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace lightwell::sim {
namespace {

constexpr double kPi = std::numbers::pi;

/// A dark blue panorama with a small bright lamp at +X.
Panorama lamp_room() {
  return from_function(64, [](Vec3d d) { return d.x > 0.99 ? Radiance{100, 100, 100} : Radiance{0, 0, 1}; });
}

TEST(Scene, IsConstantAtRest) {
  const Scene scene(lamp_room());
  for (const std::uint64_t index : {0UL, 1UL, 1000000UL}) {
    EXPECT_EQ(scene.state_at(index).yaw_rad, 0);
    EXPECT_EQ(scene.state_at(index).lamp_factor, 1);
  }
}

TEST(Scene, TheProbeSweepsForwardAndBack) {
  Motion motion;
  motion.turn_rad_per_s = 0.6;
  motion.frame_rate = 30;
  motion.cycle_frames = 32;
  const Scene scene(lamp_room(), motion);
  EXPECT_EQ(scene.state_at(0).yaw_rad, 0);
  EXPECT_NEAR(scene.state_at(5).yaw_rad, 0.1, 1e-15);
  EXPECT_NEAR(scene.state_at(16).yaw_rad, 0.32, 1e-15);
  EXPECT_NEAR(scene.state_at(31).yaw_rad, 0.02, 1e-15);
  for (std::uint64_t k = 0; k < 100; ++k) {
    const double step = scene.state_at(k + 1).yaw_rad - scene.state_at(k).yaw_rad;
    EXPECT_NEAR(std::abs(step), 0.02, 1e-15) << "jump at frame " << k;
    EXPECT_EQ(scene.state_at(k).yaw_rad, scene.state_at(k + 32).yaw_rad);
  }
}

TEST(Scene, TheTimeOffsetOfARowFollowsTheSweep) {
  Motion motion;
  motion.turn_rad_per_s = 0.6;
  motion.cycle_frames = 32;
  const Scene scene(lamp_room(), motion);
  EXPECT_NEAR(scene.state_at(5, 0.5 / 30).yaw_rad, 0.11, 1e-15);
  EXPECT_NEAR(scene.state_at(0, -1.0 / 30).yaw_rad, scene.state_at(31).yaw_rad, 1e-15);
}

TEST(Scene, ALeftRotationMovesTheLampToTheRight) {
  Motion motion;
  motion.turn_rad_per_s = kPi / 4 * 30;
  motion.cycle_frames = 8;
  const Scene scene(lamp_room(), motion);
  // A right-handed quarter turn about +Y rotates -Z to -X, so the lamp at the world's +X is behind the probe.
  const SceneState state = scene.state_at(2);
  EXPECT_NEAR(state.yaw_rad, kPi / 2, 1e-12);
  EXPECT_GT(scene.radiance({0, 0, 1}, state).r, 50);
  EXPECT_LT(scene.radiance({1, 0, 0}, state).r, 1e-6F);
  const Vec3d lamp_in_probe = rotate(state.rotation_world_probe.inverse(), Vec3d{1, 0, 0});
  EXPECT_NEAR(lamp_in_probe.z, 1, 1e-12);
}

TEST(Scene, OnlyTheLampsSwitch) {
  Motion motion;
  motion.cycle_frames = 20;
  motion.switch_period_frames = 10;
  const Scene scene(lamp_room(), motion);
  for (std::uint64_t k = 0; k < 60; ++k) EXPECT_EQ(scene.state_at(k).lamp_factor, k / 10 % 2 == 0 ? 1 : 0.05) << k;
  const SceneState on = scene.state_at(0), off = scene.state_at(10);
  EXPECT_NEAR(scene.radiance({1, 0, 0}, off).r, 0.05 * scene.radiance({1, 0, 0}, on).r, 1e-4);
  EXPECT_EQ(scene.radiance({-1, 0, 0}, off), scene.radiance({-1, 0, 0}, on));
}

}  // namespace
}  // namespace lightwell::sim
