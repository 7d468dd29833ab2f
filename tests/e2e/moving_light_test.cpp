// Rotating probe and switching lamps: every descriptor is compared with the scene at its own frame.
#include <gtest/gtest.h>

#include "e2e/daemon.hpp"
#include "e2e/light_truth.hpp"
#include "sim/scene.hpp"

namespace lightwell::test {
namespace {

constexpr Vec3d kPlusX{1, 0, 0};
constexpr std::uint64_t kRing = 32;  // The simulator's default.

/// The scene that the simulated camera shows; its motion is a function of the frame's number alone.
sim::Scene scene_of(const sim::Motion& motion) {
  return sim::Scene(sim::from_function(16, [](Vec3d) { return Radiance{1, 1, 1}; }), motion);
}

TEST(MovingLight, ALampTurnsAgainstTheProbe) {
  const TempDir folder;
  write_exr(folder.path("room.exr"), room_with_lamp_at_plus_x());
  Daemon daemon({.camera = "sim:" + folder.path("room.exr") + "?yaw_rate=60deg/s"});
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(50)) << daemon.process().err();

  sim::Motion motion;
  motion.turn_rad_per_s = 60 * kDegree;
  motion.frame_rate = 30;
  motion.cycle_frames = kRing;
  const sim::Scene scene = scene_of(motion);
  double least = 0, most = 0;
  for (const Descriptor& d : observer.descriptors()) {
    const sim::SceneState state = scene.state_at(d.sequence % kRing);
    least = std::min(least, state.yaw_rad);
    most = std::max(most, state.yaw_rad);
    const Vec3d expected = rotate(state.rotation_world_probe.inverse(), kPlusX);
    ASSERT_TRUE(light_near(d, expected, 0.5 * kDegree))
        << "descriptor " << d.sequence << ", yaw " << state.yaw_rad / kDegree << " deg";
  }
  EXPECT_GT(most - least, 25 * kDegree) << "the probe must rotate";
}

TEST(MovingLight, ALampKeepsItsTrackWhileTheProbeTurns) {
  const TempDir folder;
  write_exr(folder.path("room.exr"), room_with_lamp_at_plus_x());
  Daemon daemon({.camera = "sim:" + folder.path("room.exr") + "?yaw_rate=60deg/s"});
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(50));
  const std::vector<Descriptor> all = observer.descriptors();
  ASSERT_FALSE(all.front().lights.empty());
  for (const Descriptor& d : all) {
    ASSERT_FALSE(d.lights.empty());
    EXPECT_EQ(d.lights.front().track, all.front().lights.front().track);
  }
}

TEST(MovingLight, ALampThatIsSwitchedOnAgainKeepsItsTrackNumber) {
  // Weak enough that its remaining radiance is not reported as a light when it is off; no pixel at its rim is blended.
  const PanoramaPixels room = test::room(128,
                                         [](Vec3d d) {
                                           const float l = angle_between(d, kPlusX) < 6 * kDegree ? 40 : 0.5F;
                                           return Radiance{l, l, l};
                                         },
                                         {});
  const TempDir folder;
  write_exr(folder.path("room.exr"), room);
  constexpr std::uint64_t kPeriod = 15;
  Daemon daemon({.camera = "sim:" + folder.path("room.exr") + "?lamp_switch=0.5s"});
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(5 * kPeriod));

  sim::Motion motion;
  motion.cycle_frames = 2 * kPeriod;
  motion.switch_period_frames = kPeriod;
  const sim::Scene scene = scene_of(motion);
  std::uint32_t track = 0;
  int changes = 0;
  bool was_on = true;
  for (const Descriptor& d : observer.descriptors()) {
    const bool on = scene.state_at(d.sequence % (2 * kPeriod)).lamp_factor == 1;
    const std::optional<Light> lamp = light_near(d, kPlusX, 1 * kDegree);
    ASSERT_EQ(lamp.has_value(), on) << "descriptor " << d.sequence;
    changes += on != was_on ? 1 : 0;
    was_on = on;
    if (!lamp) continue;
    if (track == 0) track = lamp->track;
    EXPECT_EQ(lamp->track, track) << "descriptor " << d.sequence;
  }
  EXPECT_GE(changes, 3) << "the lamp must switch off and on again";
}

}  // namespace
}  // namespace lightwell::test
