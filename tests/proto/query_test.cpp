#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/query.hpp>

namespace lightwell {
namespace {

Light make_light(Vec3f direction, float radius) {
  Light l;
  l.direction = direction;
  l.irradiance = {2, 1, 0.5F};
  l.angular_radius_rad = radius;
  return l;
}

// Written by hand from proto/README.md: a light at +X.
TEST(IrradianceAt, LightAtPlusXFallsWithTheCosine) {
  Descriptor d;
  d.lights = {make_light({1, 0, 0}, 0)};
  EXPECT_NEAR(irradiance_at(d, {1, 0, 0}).r, 2, 1e-6);
  EXPECT_NEAR(irradiance_at(d, normalized(Vec3f{1, 1, 0})).g, std::numbers::sqrt2 / 2, 1e-6);
  EXPECT_EQ(irradiance_at(d, {-1, 0, 0}).r, 0);
  EXPECT_NEAR(irradiance_at(d, {0, 1, 0}).r, 0, 1e-6);
}

TEST(IrradianceAt, ConstantSphereGivesPiTimesItsRadiance) {
  Descriptor d;
  d.radiance.c[0] = {static_cast<float>(3 / 0.28209479177), 0, 0};
  for (const Vec3f n : {Vec3f{1, 0, 0}, Vec3f{0, -1, 0}, normalized(Vec3f{1, 2, 3})})
    EXPECT_NEAR(irradiance_at(d, n).r, 3 * std::numbers::pi, 1e-5 * 3 * std::numbers::pi);
}

TEST(ReflectedRadiance, IsIrradianceTimesAlbedoOverPi) {
  const Radiance l = reflected_radiance(Irradiance{1, 2, 3}, Albedo{0.5F, 0.5F, 1});
  EXPECT_NEAR(l.r, 0.5 / std::numbers::pi, 1e-7);
  EXPECT_NEAR(l.b, 3 / std::numbers::pi, 1e-6);
}

TEST(LightsRadiance, PointLightGivesTheLobeTimesItsIrradiance) {
  const std::vector<Light> lights = {make_light({0, 1, 0}, 0)};
  const GgxLobe lobe(0.5);
  const Vec3f d = normalized(Vec3f{0.3F, 0.9F, 0});
  EXPECT_NEAR(lights_radiance(lights, d, lobe).r, 2 * lobe.value(d.y), 1e-6);
}

}  // namespace
}  // namespace lightwell
