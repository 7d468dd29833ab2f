#include "ar_viewer/light_state.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "host_sdk/ar_viewer/viewer_scenes.hpp"

namespace lightwell::test {
namespace {

/// Irradiance of a state at a normal, without shadows.
Irradiance irradiance_of(const viewer::LightState& state, Vec3f normal) {
  Descriptor all = state.residual.descriptor();
  for (const viewer::ShadedLight& light : state.lights) {
    Light each;
    each.direction = light.direction;
    each.irradiance = light.irradiance;
    each.angular_radius_rad = light.angular_radius_rad;
    all.lights.push_back(each);
  }
  return Lighting::of(all).irradiance(normal).value;
}

TEST(LightState, LightsBeyondTheLimitBecomePartOfTheHarmonics) {
  Descriptor d = uniform_light({0.2F, 0.2F, 0.2F});
  for (int i = 0; i < 14; ++i)
    d.lights.push_back(
        make_light(vec_cast<float>(fibonacci_direction(i, 14)), {1 + 0.3F * static_cast<float>(i), 1, 1}, 10));
  const Lighting lighting = Lighting::of(d);
  const viewer::LightState state = viewer::make_light_state(lighting, viewer::Shading::full);
  ASSERT_EQ(state.lights.size(), viewer::kMaxShadedLights);
  EXPECT_FLOAT_EQ(state.lights[0].irradiance.r, 1 + 0.3F * 13) << "the strongest stay";
  for (int i = 0; i < 50; ++i) {
    const Vec3f n = vec_cast<float>(fibonacci_direction(i, 50));
    // Six bands of a cap of 10 degrees: what is missing is below 1 % of its irradiance.
    EXPECT_NEAR(irradiance_of(state, n).g, lighting.irradiance(n).value.g, 0.06) << i;
  }
}

TEST(LightState, FullLightIsTheDescriptors) {
  Descriptor d = uniform_light({0.2F, 0.3F, 0.4F});
  d.lights = {make_light({0, 1, 0.2F}, {1, 2, 3}, 3, 0.8F)};
  const Lighting world = Lighting::of(d).in_world(Pose{Quat::about({0, 1, 0}, 0.7), {1, 2, 3}});
  const viewer::LightState state = viewer::make_light_state(world, viewer::Shading::full);
  ASSERT_EQ(state.lights.size(), 1U);
  ASSERT_TRUE(state.lights[0].position.has_value());
  const auto expected = world.position(world.lights()[0]);
  ASSERT_TRUE(expected.has_value());
  EXPECT_LT(length(*state.lights[0].position - *expected), 1e-6);
  for (int i = 0; i < 20; ++i) {
    const Vec3f n = vec_cast<float>(fibonacci_direction(i, 20));
    EXPECT_NEAR(irradiance_of(state, n).b, world.irradiance(n).value.b, 1e-4);
  }
}

TEST(LightState, KnowsTheLightsThatTexelsOfTheMapShow) {
  Descriptor d = uniform_light({0.2F, 0.3F, 0.4F});
  d.lights = {make_light({0, 1, 0.2F}, {1, 2, 3}, 3), make_light({1, 0, 0}, {1, 1, 1}, 20)};
  d.lights[0].track = 1;
  d.lights[1].track = 2;
  EnvironmentMap map;
  map.levels = {{8, 0.1F}, {8, 0.5F}};
  map.texels.assign(128, 0);
  map.key = environment_key(map);
  map.light_tracks = {2};
  map.light_runs = {3, 1};
  map.light_texels = {0x80000001U};
  d.environment = map;
  const viewer::LightState state = viewer::make_light_state(Lighting::of(d), viewer::Shading::full);
  ASSERT_EQ(state.lights.size(), 2U);
  EXPECT_FALSE(state.lights[0].shown_in_mirror);
  EXPECT_TRUE(state.lights[1].shown_in_mirror);
  EXPECT_EQ(state.first_level, (std::array{0.1F, 0.5F}));
}

TEST(LightState, WithoutLightIsOff) {
  EXPECT_EQ(viewer::make_light_state(Lighting(), viewer::Shading::full).shading, viewer::Shading::off);
}

}  // namespace
}  // namespace lightwell::test
