// Irradiance in marker scenes, compared with closed forms.
#include "reference/marker/marker_scene.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include <gtest/gtest.h>

#include "reference/irradiance.hpp"
#include "reference/marker/marker_stage.hpp"
#include "reference/marker/test_bodies.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

constexpr double kDegree = pi / 180;

/// The cube without rotation, half a metre ahead.
MarkerScene cube_scene() {
  MarkerScene scene;
  scene.body = cube_by_hand();
  scene.probe_body.translation = {0, 0, -0.5};
  return scene;
}

/// The cube on a table, with the camera level: the table is y = -0.03.
MarkerScene cube_on_table() {
  MarkerScene scene = cube_scene();
  scene.table = table_under(scene.body, scene.probe_body, 5, {0.3, 0.3, 0.3});
  return scene;
}

/// Solid angle of a rectangle a x b seen from h above one of its corners.
double corner_solid_angle(double a, double b, double h) {
  return std::atan(a * b / (h * std::sqrt(a * a + b * b + h * h)));
}

TEST(MarkerScene, BodiesByHandAreValid) {
  EXPECT_TRUE(cube_by_hand().validate().ok()) << cube_by_hand().validate().message();
  EXPECT_TRUE(ball_by_hand().validate().ok()) << ball_by_hand().validate().message();
}

TEST(MarkerScene, IrradianceOfADistantLampFollowsTheCosine) {
  MarkerScene scene = cube_scene();
  // 60 degrees from the normal of face 0, 30 from that of face 1.
  scene.lamps.push_back(DistantLamp{{2 * std::sin(60 * kDegree), 0, 2 * std::cos(60 * kDegree)}, {4, 2, 1}});
  const Rgb front = face_irradiance(scene, 0, {0.01, -0.02}).total();
  EXPECT_NEAR(front[0], 4 * 0.5, rounding);
  EXPECT_NEAR(front[2], 1 * 0.5, rounding);
  EXPECT_NEAR(face_irradiance(scene, 1, {0, 0}).total()[1], 2 * std::cos(30 * kDegree), rounding);
  // Along the top face.
  EXPECT_NEAR(face_irradiance(scene, 4, {0, 0}).total()[0], 0, 4 * rounding);
  // The radiance of a patch is albedo / pi of that.
  const Rgb left = patch_radiance(scene, 0, std::size_t{1});
  EXPECT_NEAR(left[0], 0.6 * 2 / pi, rounding);
  EXPECT_NEAR(left[1], 0.4 * 1 / pi, rounding);
  EXPECT_NEAR(left[2], 0.2 * 0.5 / pi, rounding);
}

TEST(MarkerScene, AFaceTurnedAwayHasOnlyAmbientLight) {
  MarkerScene scene = cube_scene();
  scene.ambient = even_ambient({0.3, 0.2, 0.1});
  scene.lamps = {DistantLamp{{0, 0, 1}, {4, 2, 1}}, NearLamp{{0, 0, 0}, {1, 1, 1}, 0.025}};  // Narrower than the cube.
  for (const std::size_t away : {1u, 2u, 3u, 4u, 5u}) {
    const Incident light = face_irradiance(scene, away, {0.01, 0.02});
    EXPECT_NEAR(light.total()[0], pi * 0.3, rounding) << away;
    for (const Rgb& lamp : light.lamps) EXPECT_NEAR(lamp[0], 0, rounding) << away;
  }
  EXPECT_GT(face_irradiance(scene, 0, {0, 0}).total()[0], pi * 0.3 + 4);
}

TEST(MarkerScene, IrradianceOfANearLampFollowsInverseSquareAndCosine) {
  MarkerScene scene = cube_scene();
  // 40 cm in front of the face's middle (the face is at z = -0.47), 30 cm to the right.
  scene.lamps.push_back(NearLamp{{0.3, 0, -0.07}, {1, 2, 3}});
  // At the middle: distance 0.5, cosine 0.8.
  EXPECT_NEAR(face_irradiance(scene, 0, {0, 0}).total()[1], 2 * 0.8 / 0.25, 10 * rounding);
  // 2 cm to the left and 1 cm up: 0.32, 0.01, 0.4 away.
  const double squared = 0.32 * 0.32 + 0.01 * 0.01 + 0.16;
  EXPECT_NEAR(face_irradiance(scene, 0, {-0.02, 0.01}).total()[0], 0.4 / std::pow(squared, 1.5), 10 * rounding);
  // A fully visible ball instead of a point gives the same.
  scene.lamps = {NearLamp{{0.3, 0, -0.07}, {1, 2, 3}, 0.1}};
  EXPECT_NEAR(face_irradiance(scene, 0, {0, 0}).total()[1], 2 * 0.8 / 0.25, 10 * rounding);
}

TEST(MarkerScene, TheRingsOfAFullyVisibleBallGiveTheClosedForm) {
  MarkerScene scene = cube_scene();
  scene.lamps.push_back(NearLamp{{0.1, 0.1, -0.3}, {1, 1, 1}, 0.03});
  const double closed = face_irradiance(scene, 0, {0.01, 0}).total()[0];
  // An occluder that is near enough for occlusion tests but occludes nothing: a corner behind the lit point.
  scene.occluders.push_back(PolygonOccluder{{{0, 0, -0.48}, {0.5, 0, -0.48}, {0.5, 0.5, -0.48}}, {1, 1, 1}});
  EXPECT_NEAR(face_irradiance(scene, 0, {0.01, 0}).total()[0], closed, 100 * rounding);
}

TEST(MarkerScene, ALampHalfBelowTheHorizonOfAFace) {
  // A uniform cap of angular radius r whose centre is on the horizon: radiance L = E / (pi sin^2 r), and of the upper
  // half L times the integral of sin^2 g dg cos f df over g = 0..r, f = -pi/2..pi/2, which is L (r - sin r cos r).
  MarkerScene scene = cube_scene();
  scene.penumbra_rings = 64;
  const double r = 0.2;
  scene.lamps.push_back(DistantLamp{{1, 0, 0}, {1, 1, 1}, r});
  const double expected = (r - std::sin(r) * std::cos(r)) / (pi * std::sin(r) * std::sin(r));
  // 4,096 points; those at the horizon, where their weight is smallest, are either in or out.
  EXPECT_NEAR(face_irradiance(scene, 0, {0, 0}).total()[0], expected, 2e-3 * expected);
}

TEST(MarkerScene, IrradianceOfUniformAmbientIsPiTimesItsRadiance) {
  MarkerScene scene = cube_scene();
  scene.ambient = even_ambient({2, 1, 0.5});
  EXPECT_NEAR(scene.ambient.sh[0][0] * 0.28209479177, 2, 1e-9) << "radiance is L00 Y00";
  for (std::size_t face = 0; face < 6; ++face)
    EXPECT_NEAR(face_irradiance(scene, face, {0.01, 0.01}).total()[1], pi, 10 * rounding);
}

TEST(MarkerScene, BandOneIsOrderedYZX) {
  MarkerScene scene = cube_scene();
  // L = 1 + 0.5 y + 0.25 z - 0.125 x: irradiance pi (1 + 2/3 of the rest at the normal).
  scene.ambient = even_ambient({1, 1, 1});
  const double y1 = 0.48860251190292;
  for (std::size_t c = 0; c < 3; ++c) {
    scene.ambient.sh[1][c] = 0.5 / y1;
    scene.ambient.sh[2][c] = 0.25 / y1;
    scene.ambient.sh[3][c] = -0.125 / y1;
  }
  const double expected[6] = {0.25, -0.125, -0.25, 0.125, 0.5, -0.5};  // +Z +X -Z -X +Y -Y
  for (std::size_t face = 0; face < 6; ++face)
    EXPECT_NEAR(face_irradiance(scene, face, {0, 0}).total()[0], pi * (1 + 2.0 / 3 * expected[face]), 1e-11) << face;
}

TEST(MarkerScene, AmbientAsAFunctionOfDirection) {
  MarkerScene scene = cube_scene();
  // Band 2 through its factor pi / 4: y^2 = 1/3 + (y^2 - 1/3).
  scene.ambient = ambient_from_function([](const V3& d) { return Rgb{1 + d.x, d.y * d.y, 1}; });
  const Rgb right = face_irradiance(scene, 1, {0, 0}).total(), top = face_irradiance(scene, 4, {0, 0}).total();
  // The integrand has a kink at the horizon: 64 rows of 128 integrate it to a thousandth.
  EXPECT_NEAR(right[0], pi + 2 * pi / 3, 1e-3 * pi);
  EXPECT_NEAR(right[1], pi / 3 - pi / 12, 1e-3);
  EXPECT_NEAR(top[1], pi / 3 + pi / 6, 1e-3);
  EXPECT_NEAR(top[2], pi, 1e-3 * pi);
}

TEST(MarkerScene, APanoramaInBlocksGivesTheIrradianceOfItsPixels) {
  Panorama room = from_function(128, 64, smooth_scene, 2);
  const Panorama lamp = disc_lamp(128, 64, {0.6, 0.64, 0.48}, 0.1, {300, 200, 100});
  room = sum(room, lamp);
  const Quat turn = Quat::about({0, 1, 0}, 0.7);
  MarkerScene scene = cube_scene();
  scene.ambient = ambient_from_panorama(room, turn, 4);
  for (const V3& n : fibonacci_normals(50)) {
    const Vec3d normal{n.x, n.y, n.z};
    const Vec3d in_room = rotate(turn.inverse(), normal);
    const Rgb expected = irradiance(room, {in_room.x, in_room.y, in_room.z});
    const Rgb found = irradiance_at(scene, {0, 0, 0}, normal).total();
    // Error by blocks of 11 degrees across the horizon.
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 0.02 * expected[c] + 0.05);
  }
}

TEST(MarkerScene, TheMeanOverAPatchIsProportionalToItsSolidAngleAtTheLamp) {
  MarkerScene scene = cube_scene();
  // The integral of a near lamp's irradiance over an area is I times the area's solid angle. Patch 0 of face 0: x 22.5
  // to 30 mm, the whole height; the lamp 50 mm above its bottom left corner.
  scene.lamps.push_back(NearLamp{{0.0225, -0.03, -0.42}, {1, 1, 1}});
  const double mean = corner_solid_angle(0.0075, 0.06, 0.05) / (0.0075 * 0.06);
  EXPECT_NEAR(patch_radiance(scene, 0, std::size_t{0}, 32)[0], 0.5 / pi * mean, 1e-4 * mean);
}

TEST(MarkerScene, TheShadowOfACubesTopEdgeIsAtTheGeometricPosition) {
  MarkerScene scene = cube_on_table();
  EXPECT_NEAR(scene.table->normal.y, 1, rounding);
  EXPECT_NEAR(scene.table->point.y, -0.03, rounding);
  // A distant lamp on the right at an elevation of 40 degrees: the shadow of the top left edge is edge / tan 40 to the
  // left.
  scene.lamps.push_back(DistantLamp{{std::cos(40 * kDegree), std::sin(40 * kDegree), 0}, {1, 1, 1}});
  const double distant = -0.03 - 0.06 / std::tan(40 * kDegree);
  // A lamp 30 cm above the table and 20 cm to the right of the left edge: the edge, 6 cm high, 6 / 24 of that further.
  scene.lamps.push_back(NearLamp{{-0.03 + 0.2, 0.27, -0.5}, {1, 1, 1}});
  const double near = -0.03 - 0.2 * 0.06 / 0.24;
  const double hair = 1e-7;
  const auto lit = [&](double x, std::size_t lamp) {
    return table_irradiance(scene, {x, -0.03, -0.5}).lamps[lamp][0] > 0;
  };
  EXPECT_TRUE(lit(distant - hair, 0));
  EXPECT_FALSE(lit(distant + hair, 0));
  EXPECT_FALSE(lit(-0.031, 0));
  EXPECT_TRUE(lit(near - hair, 1));
  EXPECT_FALSE(lit(near + hair, 1));
  EXPECT_TRUE(lit(0.04, 0)) << "the lamp's side";
}

TEST(MarkerScene, ALampWithARadiusHasAPenumbraOfItsAngularSize) {
  MarkerScene scene = cube_on_table();
  scene.penumbra_rings = 32;
  const double r = 0.05;
  scene.lamps.push_back(DistantLamp{{std::cos(40 * kDegree), std::sin(40 * kDegree), 0}, {1, 1, 1}, r});
  // The edge is long compared with the penumbra, so a straight line cuts the disc.
  const auto light = [&](double elevation) {
    return table_irradiance(scene, {-0.03 - 0.06 / std::tan(elevation), -0.03, -0.5}).total()[0];
  };
  const double whole = std::sin(40 * kDegree);
  EXPECT_NEAR(light(40 * kDegree - r - 1e-3), whole, 10 * rounding);
  EXPECT_NEAR(light(40 * kDegree + r + 1e-3), 0, rounding);
  // The upper half of the disc is visible; it acts from its centroid, 4 r / 3 pi above the centre.
  const double half = 0.5 * std::sin(40 * kDegree + 4 * r / (3 * pi));
  EXPECT_NEAR(light(40 * kDegree), half, 0.02 * whole);
}

TEST(MarkerScene, OccludersOccludeLampsFromTheBody) {
  MarkerScene scene = cube_scene();
  scene.lamps.push_back(NearLamp{{0, 0, 0}, {1, 1, 1}});
  // A ball half-way between the lamp and the face's centre has a round shadow, bounded by the tangent cone.
  scene.occluders.push_back(SphereOccluder{{0, 0, -0.235}, 0.005, {0.1, 0.1, 0.1}});
  const double edge = 0.47 * std::tan(std::asin(0.005 / 0.235));
  EXPECT_EQ(face_irradiance(scene, 0, {edge - 1e-6, 0}).total()[0], 0);
  EXPECT_GT(face_irradiance(scene, 0, {edge + 1e-6, 0}).total()[0], 4);
  // A sheet whose right edge is at x = 2 mm, in both orientations.
  for (const bool turned : {false, true}) {
    PolygonOccluder sheet{{{-0.1, -0.1, -0.235}, {0.002, -0.1, -0.235}, {0.002, 0.1, -0.235}, {-0.1, 0.1, -0.235}},
                          {1, 1, 1}};
    if (turned) std::swap(sheet.corners[1], sheet.corners[3]);
    scene.occluders = {sheet};
    EXPECT_EQ(face_irradiance(scene, 0, {0.004 - 1e-6, 0}).total()[0], 0);
    EXPECT_GT(face_irradiance(scene, 0, {0.004 + 1e-6, 0}).total()[0], 4);
  }
}

TEST(MarkerScene, BallAndCardOccludeEachOther) {
  MarkerScene scene;
  scene.body = ball_by_hand();
  scene.lamps.push_back(DistantLamp{{0, 1, 0}, {1, 1, 1}});
  // From straight above the shadow is a disc of the ball's radius around x = 0.06.
  EXPECT_EQ(face_irradiance(scene, 0, {0.06 + 0.0199, 0}).total()[0], 0);
  EXPECT_NEAR(face_irradiance(scene, 0, {0.06 + 0.0201, 0}).total()[0], 1, rounding);
  EXPECT_NEAR(ball_irradiance(scene, {0, 1, 0}).total()[0], 1, rounding);
  EXPECT_NEAR(ball_irradiance(scene, normalized(Vec3d{1, 1, 0})).total()[0], std::sqrt(0.5), rounding);
  EXPECT_NEAR(ball_irradiance(scene, {1, 0, 0}).total()[0], 0, rounding);
  // From below the card is in the way.
  scene.lamps = {DistantLamp{{0, -1, 0}, {1, 1, 1}}};
  EXPECT_EQ(ball_irradiance(scene, {0.6, -0.8, 0}).total()[0], 0);
}

TEST(MarkerScene, ABodyOccludesAmbientLightOfTheTableIfEnabled) {
  MarkerScene scene = cube_on_table();
  scene.ambient = even_ambient({1, 1, 1});
  const Vec3d beside{-0.05, -0.03, -0.5};
  EXPECT_NEAR(table_irradiance(scene, beside).total()[0], pi, 10 * rounding);
  scene.table->ambient_directions = 20000;
  // Only one side of the cube is visible, 2 cm away: two vertical rectangles of 3 x 6 cm, each seen from the level of
  // its corner (Howell's catalogue of view factors, B-4).
  const double x = 0.06 / 0.03, y = 0.02 / 0.03, xy = std::sqrt(x * x + y * y);
  const double share = 2 * (std::atan(1 / y) - y / xy * std::atan(1 / xy)) / (2 * pi);
  // Of 20,000 directions, about the square root of those on the outline are misclassified.
  EXPECT_NEAR(table_irradiance(scene, beside).total()[0], pi * (1 - share), pi * 2e-3);
  EXPECT_LT(table_irradiance(scene, beside).total()[0], 0.9 * pi);
}

TEST(MarkerScene, LampTruthsAreRelativeToTheBodysOrigin) {
  MarkerStage stage;
  stage.distance_m = 0.8;
  stage.elevation_rad = 0.6;
  stage.turn_rad = 0.5;
  MarkerScene scene = cube_scene();
  scene.probe_body = stage.probe_body();
  scene.lamps = {NearLamp{stage.place(0.5, 0, 0.4), {1, 2, 3}}, DistantLamp{stage.up() * 3, {1, 1, 1}}};
  const auto truths = lamp_truths(scene);
  ASSERT_EQ(truths.size(), 2u);
  // The body's +Z axis points to the azimuth of its rotation.
  EXPECT_NEAR(length(truths[0].direction_body - Vec3d{0, 0, 1}), 0, rounding);
  EXPECT_NEAR(truths[0].distance_m, 0.4, rounding);
  EXPECT_NEAR(truths[0].irradiance[1], 2 / 0.16, 100 * rounding);
  EXPECT_NEAR(length(truths[1].direction_body - Vec3d{0, 1, 0}), 0, rounding);
  EXPECT_TRUE(std::isinf(truths[1].distance_m));
}

TEST(MarkerScene, AzimuthsOfTheStageAreRelativeToTheCamera) {
  MarkerStage stage;
  stage.elevation_rad = 0.6;
  EXPECT_GT(stage.direction(0, 0).z, 0.8) << "towards the camera";
  EXPECT_NEAR(stage.direction(pi / 2, 0).x, 1, rounding) << "to its right";
  EXPECT_LT(stage.direction(pi, 0).z, -0.8) << "behind";
  EXPECT_NEAR(dot(stage.direction(1, 0), stage.up()), 0, rounding);
  EXPECT_NEAR(dot(stage.up(), Vec3d{0, 0, 1}), std::sin(0.6), rounding) << "the camera sees the top";
}

}  // namespace
}  // namespace lightwell::reference
