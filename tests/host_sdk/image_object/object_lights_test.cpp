// The lights of a descriptor as an object sees them.
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/image_object.hpp>

namespace lightwell::test {
namespace {

using testing::HasSubstr;

Light lamp(Vec3f direction, Irradiance e, float distance_m = 0) {
  Light light;
  light.direction = direction;
  light.irradiance = e;
  light.distance_m = distance_m;
  light.distance_sigma_m = distance_m > 0 ? 0.01F : 0;
  return light;
}

Lighting lighting_of(std::vector<Light> lights, float uniform_radiance = 0) {
  Descriptor descriptor;
  descriptor.radiance.band = 2;
  descriptor.radiance.c[0] = {2 * std::sqrt(std::numbers::pi_v<float>) * uniform_radiance, 0, 0};
  descriptor.lights = std::move(lights);
  return Lighting::of(descriptor);
}

std::vector<ObjectLight> lights_of(const Lighting& lighting, const Pose& pose, int residual = 0) {
  std::vector<ObjectLight> lights;
  const Status done = object_lights(lighting, pose, residual, lights);
  EXPECT_TRUE(done.ok()) << done.message();
  return lights;
}

TEST(ObjectLights, HaveTheDirectionInTheFrameOfTheObject) {
  // The object's -Z is the lighting's -X.
  const Pose pose{Quat::about({0, 1, 0}, std::numbers::pi / 2), {}};
  const auto lights = lights_of(lighting_of({lamp({-1, 0, 0}, {1, 2, 3})}), pose);
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_NEAR(lights[0].direction.z, -1, 1e-6);
  EXPECT_EQ(lights[0].irradiance, (Irradiance{1, 2, 3}));
}

TEST(ObjectLights, OfNearLampsFallOffWithTheSquaredDistance) {
  // 2 m above the origin; the object 1 m above it.
  const auto lights = lights_of(lighting_of({lamp({0, 1, 0}, {1, 1, 1}, 2)}), {{}, {0, 1, 0}});
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_NEAR(lights[0].irradiance.g, 4, 1e-5);
  // Seen from 2 m beside the lamp's foot it is at 45 degrees.
  const auto beside = lights_of(lighting_of({lamp({0, 1, 0}, {1, 1, 1}, 2)}), {{}, {2, 0, 0}});
  EXPECT_NEAR(beside[0].direction.x, -std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(beside[0].irradiance.g, 0.5, 1e-5);
}

TEST(ObjectLights, OfLampAtTheObjectAreRefused) {
  std::vector<ObjectLight> lights(3);
  const Status refused = object_lights(lighting_of({lamp({0, 1, 0}, {1, 1, 1}, 2)}), {{}, {0, 2, 0}}, 0, lights);
  EXPECT_EQ(refused.code(), StatusCode::invalid_argument);
  EXPECT_THAT(refused.message(), HasSubstr("at the object's origin"));
  EXPECT_EQ(lights.size(), 3U);
}

TEST(ObjectLights, OfTheResidualHoldAllOfItsLight) {
  const auto lights = lights_of(lighting_of({}, 0.5F), {}, 48);
  ASSERT_EQ(lights.size(), 48U);
  double sum = 0;
  for (const ObjectLight& light : lights) sum += static_cast<double>(light.irradiance.r);
  EXPECT_NEAR(sum, 4 * std::numbers::pi * 0.5, 1e-3);
  EXPECT_EQ(lights[0].irradiance.g, 0);
  // Caps of 4 pi / 48 sr; a single one is at most a hemisphere.
  EXPECT_NEAR(1 - std::cos(lights[0].angular_radius_rad), 2.0 / 48, 1e-6);
  EXPECT_NEAR(lights_of(lighting_of({}, 0.5F), {}, 1)[0].angular_radius_rad, std::numbers::pi / 2, 1e-6);
}

TEST(ObjectLights, LeaveOutLightsWithoutIrradiance) {
  EXPECT_TRUE(lights_of(lighting_of({lamp({0, 1, 0}, {})}), {}, 16).empty());
}

TEST(ObjectLights, OfNoLightingAreRefusedWithTheReason) {
  std::vector<ObjectLight> lights;
  const Status refused = object_lights(Lighting(), {}, 8, lights);
  EXPECT_EQ(refused.code(), StatusCode::failed_precondition);
  EXPECT_THAT(refused.message(), HasSubstr("none"));
}

TEST(ObjectLights, RefusePosesAndCountsThatAreNone) {
  std::vector<ObjectLight> lights;
  const Lighting lighting = lighting_of({}, 1);
  EXPECT_THAT(object_lights(lighting, {{0, 0, 0, 0}, {}}, 8, lights).message(), HasSubstr("pose"));
  EXPECT_THAT(object_lights(lighting, {{}, {NAN, 0, 0}}, 8, lights).message(), HasSubstr("pose"));
  EXPECT_THAT(object_lights(lighting, {}, -1, lights).message(), HasSubstr("residual_directions is -1"));
  EXPECT_THAT(object_lights(lighting, {}, 513, lights).message(), HasSubstr("residual_directions is 513"));
}

}  // namespace
}  // namespace lightwell::test
