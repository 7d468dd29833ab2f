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

TEST(World, OnlyThePosesRotationMatters) {
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
