// Lighting in the application's world frame.
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/lighting.hpp>

#include "host_sdk/scenes.hpp"

namespace lightwell {
namespace {

constexpr double kQuarter = std::numbers::pi / 2;

/// A lamp at 0.5 m towards +X from an origin that is 1 m in front of the probe, and a distant light.
Descriptor marker_scene() {
  Descriptor scene = test::one_light({1, 0, 0}, {1, 2, 3});
  scene.lights.push_back(test::light({0, 1, 0}, {0.5F, 0.5F, 0.5F}, 0, 2));
  scene.lights[0].distance_m = 0.5F;
  scene.lights[0].distance_sigma_m = 0.02F;
  scene.T_probe_origin = {Quat::about({1, 0, 0}, 0.3), {0, 0, -1}};
  return scene;
}

void expect_near(Vec3d got, Vec3d expected) {
  // Directions are floats.
  EXPECT_NEAR(got.x, expected.x, 1e-6);
  EXPECT_NEAR(got.y, expected.y, 1e-6);
  EXPECT_NEAR(got.z, expected.z, 1e-6);
}

TEST(World, PositionIsThatOfTheLampInTheFrameAskedFor) {
  const Lighting lighting = Lighting::of(marker_scene());
  const auto position = [](const Lighting& in, std::size_t light) { return in.position(in.lights()[light]); };
  ASSERT_TRUE(position(lighting, 0));
  expect_near(*position(lighting, 0), {0.5, 0, -1});
  EXPECT_FALSE(position(lighting, 1)) << "no distance is known";
  // The probe is rotated left by pi/2 about up: its -Z is the world's -X, its +X the world's -Z.
  const Quat left = Quat::about({0, 1, 0}, kQuarter);
  const Lighting turned = lighting.rotated(left);
  expect_near(*position(turned, 0), {-1, 0, -0.5});
  EXPECT_EQ(turned.lights()[0].distance_m, 0.5F);
  const Lighting world = lighting.in_world(Pose{left, {5, -2, 100}});
  expect_near(*position(world, 0), {4, -2, 99.5});
  EXPECT_FALSE(position(world, 1));
  // A rotation of the world again: about its origin.
  expect_near(*position(world.rotated(left), 0), {99.5, -2, -4});
  EXPECT_FALSE(Lighting().position(marker_scene().lights[1]));
}

TEST(World, OriginIsThePoseOfTheMarkerInTheFrameAskedFor) {
  const Lighting lighting = Lighting::of(marker_scene());
  EXPECT_EQ(lighting.origin(), marker_scene().T_probe_origin);
  const Quat left = Quat::about({0, 1, 0}, kQuarter);
  const Pose origin = lighting.in_world(Pose{left, {5, -2, 100}}).origin();
  expect_near(origin.translation, {4, -2, 100});
  // Up of the marker: (0, cos 0.3, sin 0.3) in the probe's axes.
  expect_near(rotate(origin.rotation, Vec3d{0, 1, 0}), {std::sin(0.3), std::cos(0.3), 0});
  EXPECT_EQ(Lighting::of(test::one_light({1, 0, 0}, {1, 2, 3})).origin(), Pose{}) << "the probe";
  EXPECT_EQ(Lighting().origin(), Pose{});
}

TEST(World, UnknownTranslationOfThePoseLeavesNoPosition) {
  UncertainPose pose;
  pose.covariance[4][4] = std::numeric_limits<double>::infinity();
  const Lighting world = Lighting::of(marker_scene()).in_world(pose);
  ASSERT_EQ(world.validity(), Validity::valid);
  EXPECT_FALSE(world.position(world.lights()[0]));
  EXPECT_EQ(world.lights()[0].distance_sigma_m, 0);
  pose.covariance[4][4] = 1e-4;
  const Lighting placed = Lighting::of(marker_scene()).in_world(pose);
  EXPECT_TRUE(placed.position(placed.lights()[0]));
}

TEST(World, OnlyThePosesRotationMattersToIrradiance) {
  // The probe is rotated left by pi/2 about up: its -Z is the world's -X, its +X the world's -Z.
  const Lighting lighting = Lighting::of(test::one_light({1, 0, 0}, {1, 2, 3}));
  const Pose here{Quat::about({0, 1, 0}, kQuarter), {0, 0, 0}}, there{here.rotation, {5, -2, 100}};
  for (const Pose& T_world_probe : {here, there}) {
    const Lighting world = lighting.in_world(T_world_probe);
    ASSERT_EQ(world.validity(), Validity::valid);
    EXPECT_NEAR(world.lights()[0].direction.z, -1, 1e-6);
    EXPECT_NEAR(world.irradiance({0, 0, -1}).value.b, 3, 1e-6);
    EXPECT_NEAR(world.irradiance({1, 0, 0}).value.b, 0, 1e-6);
  }
}

TEST(World, InvalidPoseIsFlagged) {
  const Lighting lighting = Lighting::of(test::one_light({1, 0, 0}, {1, 2, 3}));
  const Pose none{{0, 0, 0, 0}, {}};
  EXPECT_EQ(lighting.in_world(none).validity(), Validity::invalid_query);
  EXPECT_EQ(lighting.in_world(UncertainPose{none, {}}).validity(), Validity::invalid_query);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(lighting.in_world(Pose{{}, {0, bad, 0}}).validity(), Validity::invalid_query);
  EXPECT_EQ(Lighting().in_world(Pose{}).validity(), Validity::none);
  EXPECT_EQ(Lighting().in_world(UncertainPose{}).validity(), Validity::none);
}

/// Variance of the direction along a world axis.
double along(const Light& light, Vec3d axis) {
  const auto [u, v] = tangent_basis(vec_cast<double>(light.direction));
  const auto& c = light.direction_covariance;
  const double a = dot(u, axis), b = dot(v, axis);
  return static_cast<double>(c[0]) * a * a + 2 * static_cast<double>(c[1]) * a * b + static_cast<double>(c[2]) * b * b;
}

TEST(World, RotationCovarianceAddsToDirectionCovariance) {
  Descriptor scene = test::one_light({1, 0, 0}, {3, 3, 3});
  scene.lights.push_back(test::light({0, 1, 0}, {2, 2, 2}));
  scene.lights[0].direction_covariance = {1e-6F, 0, 1e-6F};
  UncertainPose pose;
  pose.covariance[1][1] = 4e-4;  // about the world's up, 0.02 rad
  const Lighting world = Lighting::of(scene).in_world(pose);
  // A rotation about up moves a direction at +X along Z, and does not move the zenith.
  EXPECT_NEAR(along(world.lights()[0], {0, 0, 1}), 4e-4 + 1e-6, 1e-9);
  EXPECT_NEAR(along(world.lights()[0], {0, 1, 0}), 1e-6, 1e-9);
  EXPECT_NEAR(along(world.lights()[1], {1, 0, 0}), 0, 1e-9);
  EXPECT_NEAR(along(world.lights()[1], {0, 0, 1}), 0, 1e-9);
}

TEST(World, CorrelatedRotationCovarianceIsTransformed) {
  // One axis (1, 1, 0) / sqrt 2 of 0.1 rad: at +X the direction moves by w x d = (0, w_z, -w_y), so 0.005 along Z.
  UncertainPose pose;
  pose.covariance[0][0] = pose.covariance[1][1] = pose.covariance[0][1] = pose.covariance[1][0] = 0.005;
  Descriptor scene = test::one_light({1, 1, 0}, {3, 3, 3});
  scene.lights.push_back(test::light({1, -1, 0}, {2, 2, 2}));
  const Lighting world = Lighting::of(scene).in_world(pose);
  EXPECT_NEAR(along(world.lights()[0], {0, 0, 1}), 0, 1e-8) << "it lies on the axis";
  EXPECT_NEAR(along(world.lights()[1], {0, 0, 1}), 0.01, 1e-8) << "it lies across";
}

TEST(World, UnknownRotationGivesInfiniteVariance) {
  UncertainPose pose;
  pose.covariance[1][1] = std::numeric_limits<double>::infinity();
  Descriptor scene = test::one_light({1, 0, 0}, {3, 3, 3});
  scene.lights.push_back(test::light({0, 1, 0}, {2, 2, 2}));
  const Lighting world = Lighting::of(scene).in_world(pose);
  EXPECT_TRUE(std::isinf(world.lights()[0].direction_covariance[0]));
  EXPECT_EQ(world.lights()[0].direction_covariance[1], 0);
  EXPECT_NEAR(along(world.lights()[1], {1, 0, 0}), 0, 1e-9) << "a turn about up does not move the zenith";
}

}  // namespace
}  // namespace lightwell
