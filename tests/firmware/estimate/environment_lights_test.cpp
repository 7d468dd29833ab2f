// Subtraction of lights from a map that contains them: what is left, and how much is taken.
#include "estimate/common/environment_lights.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/cap.hpp>

namespace lightwell::estimate {
namespace {

constexpr float kDegree = std::numbers::pi_v<float> / 180;
constexpr float kSky = 1;

const OctahedralGrid& grid() {
  static const OctahedralGrid made(64, 4);
  return made;
}

/// Mean of a scene over each texel, by 24 x 24 samples.
std::vector<Rgbx> texels_of(const std::function<float(Vec3f)>& scene) {
  static const OctahedralGrid fine(64, 24);
  std::vector<Rgbx> out(fine.texels());
  for (std::size_t k = 0; k < fine.sample.size(); ++k) {
    const float part = scene(fine.sample[k].direction) * fine.sample[k].solid_angle /
                       static_cast<float>(fine.solid_angle[k / fine.per_texel()]);
    for (std::size_t c = 0; c < 3; ++c) out[k / fine.per_texel()].v[c] += part;
  }
  return out;
}

Light light_of(Vec3f direction, float radius_deg, float irradiance) {
  Light light;
  light.direction = normalized(direction);
  light.angular_radius_rad = radius_deg * kDegree;
  light.irradiance = {irradiance, irradiance, irradiance};
  return light;
}

/// Vector irradiance of a cap with this radiance.
float cap_power(float radius_deg, float radiance) {
  return radiance * static_cast<float>(cap_vector_irradiance(radius_deg * kDegree));
}

/// A sky with a lamp whose light arrives in the texel of `towards`.
std::vector<Rgbx> sky_with_lamp(Vec3f towards, float irradiance) {
  std::vector<Rgbx> out(grid().texels(), Rgbx{{kSky, kSky, kSky, 1}});
  const std::size_t texel = grid().texel_of(towards);
  for (std::size_t c = 0; c < 3; ++c) out[texel].v[c] += irradiance / static_cast<float>(grid().solid_angle[texel]);
  return out;
}

double total(std::span<const Rgbx> texels) {
  double sum = 0;
  for (std::size_t k = 0; k < texels.size(); ++k) sum += grid().solid_angle[k] * texels[k].v[0];
  return sum;
}

void subtract(LightSubtraction& subtraction, std::span<const Light> lights, float radiance_per_unit,
              std::span<Rgbx> texels) {
  for (const Light& light : lights)
    LightSubtraction::subtract(subtraction.removal(light, radiance_per_unit, texels), texels);
}

const Vec3f kDirections[] = {{0, 1, 0},       {0, -1, 0},          {1, 0, 0},
                             {-0.01F, 0, -1}, {0.3F, 0.8F, -0.5F}, {-0.6F, -0.7F, 0.2F}};

TEST(LightSubtraction, ACapOfTheRegionsShapeLeavesItsSurroundings) {
  LightSubtraction subtraction(grid());
  for (const Vec3f at : kDirections) {
    const Vec3f axis = normalized(at);
    std::vector<Rgbx> texels =
        texels_of([&](Vec3f d) { return kSky + (dot(d, axis) > std::cos(15 * kDegree) ? 10.0F : 0.0F); });
    const Light light = light_of(axis, 15, cap_power(15, 10));
    subtract(subtraction, {&light, 1}, 1, texels);
    // The rim of the cap is sampled by four points across a texel.
    for (const Rgbx& t : texels) EXPECT_NEAR(t.v[0], kSky, 0.05 * 10);
  }
}

TEST(LightSubtraction, MapAndCapAddUpToARegionOfAnotherShape) {
  LightSubtraction subtraction(grid());
  const auto bar = [](Vec3f d) { return d.z < 0 && std::abs(d.x) < 0.5F && std::abs(d.y) < 0.1F ? 10.0F : kSky; };
  const std::vector<Rgbx> scene = texels_of(bar);
  std::vector<Rgbx> texels = scene;
  const Light light = light_of({0, 0, -1}, 16, cap_power(16, 6));
  subtract(subtraction, {&light, 1}, 1, texels);
  const std::vector<Rgbx> cap = texels_of([&](Vec3f d) { return -d.z > std::cos(16 * kDegree) ? 6.0F : 0.0F; });
  for (std::size_t k = 0; k < texels.size(); ++k) EXPECT_NEAR(texels[k].v[1] + cap[k].v[1], scene[k].v[1], 0.05 * 6);
  EXPECT_NEAR(total(scene) - total(texels), total(cap), 0.01 * total(cap));
}

TEST(LightSubtraction, ANarrowLightLeavesNeitherBrightNorNegativeTexels) {
  LightSubtraction subtraction(grid());
  for (const Vec3f at : kDirections)
    for (const float error_deg : {0.0F, 0.4F}) {
      std::vector<Rgbx> texels = sky_with_lamp(at, 100);
      const Light light = light_of(normalized(at) + Vec3f{0, error_deg * kDegree, error_deg * kDegree}, 0.27F, 100);
      subtract(subtraction, {&light, 1}, 1, texels);
      for (const Rgbx& t : texels) EXPECT_NEAR(t.v[2], kSky, 0.01) << at.x << ' ' << at.y << ' ' << error_deg;
    }
}

TEST(LightSubtraction, ANarrowLightTakesItsIrradianceAndNoMore) {
  LightSubtraction subtraction(grid());
  std::vector<Rgbx> texels = sky_with_lamp({0.3F, 0.8F, -0.5F}, 100);
  const double before = total(texels);
  const Light light = light_of({0.3F, 0.8F, -0.5F}, 0.27F, 60);
  subtract(subtraction, {&light, 1}, 1, texels);
  EXPECT_NEAR(before - total(texels), 60, 0.01);
  // The units of the lights: 0.25 of the map's radiance is one of the lights'.
  subtract(subtraction, {&light, 1}, 0.25F, texels);
  EXPECT_NEAR(before - total(texels), 75, 0.01);
}

TEST(LightSubtraction, EightLightsInOneTexelDoNotMakeItNegative) {
  LightSubtraction subtraction(grid());
  std::vector<Rgbx> texels = sky_with_lamp({0.3F, 0.8F, -0.5F}, 100);
  const std::vector<Light> lights(8, light_of({0.3F, 0.8F, -0.5F}, 0.27F, 50));
  subtract(subtraction, lights, 1, texels);
  for (const Rgbx& t : texels) EXPECT_NEAR(t.v[0], kSky, 0.01);
}

TEST(LightSubtraction, ALightThatWidensChangesTheMapGradually) {
  LightSubtraction subtraction(grid());
  const Vec3f axis = normalized(Vec3f{0.3F, 0.8F, -0.5F});
  const std::vector<Rgbx> scene =
      texels_of([&](Vec3f d) { return kSky + (dot(d, axis) > std::cos(5 * kDegree) ? 10.0F : 0.0F); });
  std::vector<Rgbx> previous;
  for (float radius_deg = 2; radius_deg < 8; radius_deg += 0.05F) {
    std::vector<Rgbx> texels = scene;
    const Light light = light_of(axis, radius_deg, cap_power(5, 10));
    subtract(subtraction, {&light, 1}, 1, texels);
    double change = 0;
    for (std::size_t k = 0; k < previous.size(); ++k)
      change += grid().solid_angle[k] * std::abs(texels[k].v[0] - previous[k].v[0]);
    EXPECT_LT(change, 0.1 * cap_power(5, 10)) << radius_deg;
    previous = std::move(texels);
  }
}

TEST(LightSubtraction, DarkLightsAndDarkMapsStayAsTheyAre) {
  LightSubtraction subtraction(grid());
  std::vector<Rgbx> dark(grid().texels());
  const Light lights[] = {light_of({0, 1, 0}, 0.27F, 5), light_of({0, 0, 1}, 20, 0)};
  subtract(subtraction, lights, 1, dark);
  for (const Rgbx& t : dark) EXPECT_EQ(t.v[0], 0);
}

}  // namespace
}  // namespace lightwell::estimate
