// Lamps of known distance, as patterns.
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/descriptor.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/relight.hpp>

#include "host_sdk/relight/wall_scene.hpp"

namespace lightwell::test {
namespace {

constexpr Vec3d kCentre{0, 0, -2};
/// Of the wall: from its middle to the centre of a corner's pixel.
const double kRadius = std::hypot(19.5, 14.5) * 0.05;

WallScene wall_with_three_lights() {
  WallScene scene;
  for (const Vec3d& d : {Vec3d{1, 0.8, 1}, Vec3d{-1, 0.7, 1.2}, Vec3d{0.1, -1, 1}})
    scene.basis.push_back({kCentre + normalized(d) * 3.0, LightDistance::finite, {3, 2, 1}});
  return scene;
}

/// A lamp of intensity {4, 3, 2} at that place, as a probe at `origin` describes it.
Light lamp_at(Vec3d place, Vec3d origin) {
  const Vec3d to = place - origin;
  Light out;
  out.direction = vec_cast<float>(normalized(to));
  out.irradiance = Irradiance{4, 3, 2} * static_cast<float>(1 / dot(to, to));
  out.distance_m = static_cast<float>(length(to));
  return out;
}

Lighting lighting_of(std::vector<Light> lights, Vec3d origin) {
  Descriptor descriptor;
  descriptor.lights = std::move(lights);
  descriptor.T_probe_origin.translation = origin;
  return Lighting::of(descriptor);
}

std::vector<Radiance> relit(const WallScene& scene, const PlaceLights& lights) {
  AlphaMaps alpha;
  const auto summary = alpha.compute(scene.subject(), scene.basis, lights.patterns, lights.weights);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  const auto photographs = scene.photographs();
  std::vector<Radiance> out(scene.camera.pixels());
  EXPECT_TRUE(relight_direct(alpha, spans_of(photographs), out).ok());
  return out;
}

// Lambert's law and the squared distance hold at each pixel; one weight of each photograph misses the edge by 60 %.
TEST(PlaceLights, ANearLampLightsEachPointFromItsPlace) {
  const WallScene scene = wall_with_three_lights();
  const RelightSubject subject = scene.subject();
  const Vec3d place{0.3, 0.2, -0.4};
  const Lighting light = lighting_of({lamp_at(place, kCentre)}, kCentre);
  const auto lights = place_lights(light, {}, scene.basis, subject, 0);
  ASSERT_TRUE(lights.ok()) << lights.status().message();
  ASSERT_EQ(lights->patterns.size(), 1U);
  EXPECT_TRUE(lights->left_in_weights.empty());
  for (const RgbFactor& weight : lights->weights) EXPECT_EQ(weight, RgbFactor{});
  const auto picture = relit(scene, *lights);
  const auto constant = relit(scene, {{}, basis_weights(light, {}, scene.basis, kCentre, 0).value(), {}});
  double worst_constant = 0;
  for (std::size_t p = 0; p < picture.size(); ++p) {
    const Radiance truth = scene.lit(p, place, {4, 3, 2});
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(picture[p][c], truth[c], 1e-3 * truth[c]) << p;
    worst_constant = std::max(worst_constant, std::abs(constant[p].g / truth.g - 1.0));
  }
  EXPECT_GT(worst_constant, 0.6);
}

// A lighting elsewhere in the world, turned: the lamp stays where it is.
TEST(PlaceLights, ThePoseOfTheLightingCounts) {
  const WallScene scene = wall_with_three_lights();
  const RelightSubject subject = scene.subject();
  const Vec3d place{-0.5, 0.6, 0};
  const Pose T_world_lighting{Quat::about(normalized(Vec3d{1, 2, 3}), 1.1), {0.4, -0.2, 0.7}};
  const Pose T_lighting_world = inverse(T_world_lighting);
  const Vec3d origin = transformed(T_lighting_world, kCentre);
  const Lighting light = lighting_of({lamp_at(transformed(T_lighting_world, place), origin)}, origin);
  const auto lights = place_lights(light, T_world_lighting, scene.basis, subject, 0);
  ASSERT_TRUE(lights.ok()) << lights.status().message();
  ASSERT_EQ(lights->patterns.size(), 1U);
  EXPECT_LT(length(lights->patterns[0].T_world_light.translation - place), 1e-6);
  const auto picture = relit(scene, *lights);
  for (std::size_t p = 0; p < picture.size(); p += 7)
    EXPECT_NEAR(picture[p].g, scene.lit(p, place, {4, 3, 2}).g, 1e-3 * picture[p].g) << p;
}

TEST(PlaceLights, DistantLightAndFarLampsStayWeights) {
  const WallScene scene = wall_with_three_lights();
  Light sun;
  sun.direction = {0, 0, 1};
  sun.irradiance = {5, 5, 5};
  const Vec3d far{0, 0, 101 * kRadius};
  const Lighting light = lighting_of({sun, lamp_at(far, kCentre)}, kCentre);
  const auto lights = place_lights(light, {}, scene.basis, scene.subject());
  ASSERT_TRUE(lights.ok());
  EXPECT_TRUE(lights->patterns.empty());
  EXPECT_TRUE(lights->left_in_weights.empty());
  EXPECT_EQ(lights->weights, basis_weights(light, {}, scene.basis, kCentre).value());
}

// No picture of a projector surrounds the subject: such a lamp is said to be left.
TEST(PlaceLights, ALampBesideTheSubjectIsLeftInTheWeights) {
  const WallScene scene = wall_with_three_lights();
  const Lighting light = lighting_of(
      {lamp_at({0, 0, -2 + 1.1 * kRadius}, kCentre), lamp_at({0, 0, -2 + 1.3 * kRadius}, kCentre)}, kCentre);
  const auto lights = place_lights(light, {}, scene.basis, scene.subject(), 0);
  ASSERT_TRUE(lights.ok());
  EXPECT_EQ(lights->patterns.size(), 1U);
  EXPECT_EQ(lights->left_in_weights, std::vector<std::size_t>{0});
  EXPECT_GT(lights->weights[0].g + lights->weights[1].g + lights->weights[2].g, 0);
  // At 1.3 radii the picture still covers all of the wall.
  const auto picture = relit(scene, {lights->patterns, {}, {}});
  for (std::size_t p = 0; p < picture.size(); ++p) {
    const Radiance truth = scene.lit(p, {0, 0, -2 + 1.3 * kRadius}, {4, 3, 2});
    EXPECT_NEAR(picture[p].g, truth.g, 2e-3 * truth.g) << p;
  }
}

TEST(PlaceLights, MoreLampsThanPatternsStayWeights) {
  const WallScene scene = wall_with_three_lights();
  std::vector<Light> lamps;
  for (std::size_t i = 0; i <= AlphaMaps::kMaxPatterns; ++i)
    lamps.push_back(lamp_at({0.01 * static_cast<double>(i), 0, 1}, kCentre));
  const auto lights = place_lights(lighting_of(lamps, kCentre), {}, scene.basis, scene.subject(), 0);
  ASSERT_TRUE(lights.ok());
  EXPECT_EQ(lights->patterns.size(), AlphaMaps::kMaxPatterns);
  EXPECT_EQ(lights->left_in_weights, std::vector<std::size_t>{AlphaMaps::kMaxPatterns});
}

TEST(PlaceLights, Refuses) {
  const WallScene scene = wall_with_three_lights();
  EXPECT_EQ(place_lights(Lighting(), {}, scene.basis, scene.subject()).status().code(),
            StatusCode::failed_precondition);
  const std::vector<float> nothing(scene.camera.pixels(), 0);
  const auto empty = RelightSubject::from_depth(scene.camera, nothing, {}).value();
  const auto refused = place_lights(lighting_of({}, kCentre), {}, scene.basis, empty).status();
  EXPECT_NE(refused.message().find("no geometry"), std::string::npos) << refused.message();
  // A lamp at the subject's centre has no irradiance there.
  EXPECT_FALSE(place_lights(lighting_of({lamp_at({0, 0, -2}, {0, 0, 0})}, {}), {}, scene.basis, scene.subject()).ok());
}

}  // namespace
}  // namespace lightwell::test
