// The pose of a marker's centre: the origin of its descriptors.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "estimate/marker/shading.hpp"
#include "firmware/estimate/marker/shipped_bodies.hpp"

namespace lightwell::marker {
namespace {

using test::pinhole;

TEST(PosedBody, OriginIsTheMeasuringCentreWithTheAxesOfTheBody) {
  const LensParameters lens = pinhole();
  const CameraModel model(lens);
  const Quat turn = Quat::about({0, 1, 0}, 0.5);
  // The rotation of a pose that was composed of many is not quite a unit quaternion.
  const Pose unit{turn, {0.1, 0.2, -0.6}}, longer{{0, 1.001 * turn.y, 0, 1.001 * turn.w}, unit.translation};
  auto solid = load_marker_body(std::string(LIGHTWELL_MARKER_BODIES) + "/dodecahedron_100mm_white.textproto");
  ASSERT_TRUE(solid.ok()) << solid.status().message();
  EXPECT_EQ(PosedBody(*solid, lens, model, unit).probe_origin().translation, unit.translation);
  const Quat q = PosedBody(*solid, lens, model, longer).probe_origin().rotation;
  EXPECT_NEAR(q.y, turn.y, 1e-12) << "a unit quaternion, as the wire requires";
  EXPECT_NEAR(q.w, turn.w, 1e-12);

  auto ball = load_marker_body(std::string(LIGHTWELL_MARKER_BODIES) + "/ball_40mm.textproto");
  ASSERT_TRUE(ball.ok() && ball->ball) << ball.status().message();
  ball->ball->center = {0, 0, 0.03};
  const Vec3d center = PosedBody(*ball, lens, model, unit).probe_origin().translation;
  EXPECT_NEAR(center.x, 0.1 + 0.03 * std::sin(0.5), 1e-12);
  EXPECT_NEAR(center.y, 0.2, 1e-12);
  EXPECT_NEAR(center.z, -0.6 + 0.03 * std::cos(0.5), 1e-12);
}

}  // namespace
}  // namespace lightwell::marker
