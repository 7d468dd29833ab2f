// Constant weights for distant light.
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/descriptor.hpp>
#include <lightwell/equirect.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/relight.hpp>

namespace lightwell::test {
namespace {

std::vector<BasisLight> sphere_of_lights(int count) {
  std::vector<BasisLight> out;
  for (int i = 0; i < count; ++i)
    out.push_back({fibonacci_direction(i, count) * 2.0, LightDistance::finite, {8, 4, 2}});
  return out;
}

/// Irradiance of a matte receiver at the origin from the weighted lights.
Irradiance irradiance(const std::vector<BasisLight>& basis, const std::vector<RgbFactor>& weights, Vec3d normal) {
  Irradiance sum;
  for (std::size_t i = 0; i < basis.size(); ++i) {
    const auto cosine = static_cast<float>(std::max(0.0, dot(normalized(basis[i].place), normal)));
    for (int c = 0; c < 3; ++c) sum[c] += weights[i][c] * basis[i].irradiance[c] / 4 * cosine;
  }
  return sum;
}

// An even panorama: irradiance pi times its radiance, in all directions.
TEST(BasisWeights, EvenPanorama) {
  const auto basis = sphere_of_lights(29);
  const std::vector<Radiance> panorama(64 * 32, {1, 2, 3});
  const auto weights = basis_weights(panorama, 64, 32, basis, {});
  ASSERT_TRUE(weights.ok()) << weights.status().message();
  for (int i = 0; i < 20; ++i) {
    const Irradiance e = irradiance(basis, *weights, fibonacci_direction(i, 20));
    // 29 directions instead of all: 5 %.
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(e[c], static_cast<float>(c + 1) * std::numbers::pi_v<float>, 0.05 * (c + 1) * 3.14);
  }
}

// A sun in a direction between lights lights surfaces that face all of these as itself.
TEST(BasisWeights, SunOfADescriptor) {
  const auto basis = sphere_of_lights(29);
  Descriptor descriptor;
  Light sun;
  const Vec3d towards = normalized(Vec3d{0.3, 0.8, 0.5});
  sun.direction = vec_cast<float>(towards);
  sun.irradiance = {9, 8, 7};
  descriptor.lights.push_back(sun);
  const auto weights = basis_weights(Lighting::of(descriptor), {}, basis, {}, 0);
  ASSERT_TRUE(weights.ok()) << weights.status().message();
  const Irradiance e = irradiance(basis, *weights, towards);
  EXPECT_NEAR(e.r, 9, 1e-4);
  EXPECT_NEAR(e.g, 8, 1e-4);
  EXPECT_NEAR(e.b, 7, 1e-4);
  // The same sun of a probe that is turned by half a turn comes from behind.
  const auto turned =
      basis_weights(Lighting::of(descriptor), {Quat::about({0, 1, 0}, std::numbers::pi), {}}, basis, {}, 0);
  ASSERT_TRUE(turned.ok());
  EXPECT_NEAR(irradiance(basis, *turned, normalized(Vec3d{-0.3, 0.8, -0.5})).r, 9, 1e-4);
}

TEST(BasisWeights, ResidualOfADescriptor) {
  const auto basis = sphere_of_lights(29);
  Descriptor descriptor;
  // Radiance 1 from everywhere.
  descriptor.radiance.c[0] = {3.5449077F, 3.5449077F, 3.5449077F};
  const auto weights = basis_weights(Lighting::of(descriptor), {}, basis, {});
  ASSERT_TRUE(weights.ok());
  EXPECT_NEAR(irradiance(basis, *weights, {0, 1, 0}).g, std::numbers::pi, 0.1);
}

TEST(BasisWeights, FewLightsStandForWhatIsNearest) {
  const std::vector<BasisLight> basis = {{{0, 0, 2}, LightDistance::finite, {4, 4, 4}}};
  const std::vector<Radiance> panorama(8 * 4, {1, 1, 1});
  const auto weights = basis_weights(panorama, 8, 4, basis, {});
  ASSERT_TRUE(weights.ok());
  // All of the sphere, at irradiance 1 of the light.
  EXPECT_NEAR((*weights)[0].r, 4 * std::numbers::pi, 1e-3);
}

TEST(BasisWeights, RefusesByName) {
  const auto basis = sphere_of_lights(4);
  const std::vector<Radiance> panorama(8 * 4, {1, 1, 1});
  EXPECT_EQ(basis_weights(Lighting(), {}, basis, {}).status().code(), StatusCode::failed_precondition);
  EXPECT_FALSE(basis_weights(panorama, 8, 5, basis, {}).ok());
  EXPECT_FALSE(basis_weights(panorama, 8, 4, {}, {}).ok());
  std::vector<BasisLight> dark = basis;
  dark[2].irradiance.g = 0;
  const auto refused = basis_weights(panorama, 8, 4, dark, {}).status();
  EXPECT_NE(refused.message().find("basis light 2"), std::string::npos) << refused.message();
  std::vector<Radiance> nan = panorama;
  nan[9].r = std::nanf("");
  EXPECT_FALSE(basis_weights(nan, 8, 4, basis, {}).ok());
}

}  // namespace
}  // namespace lightwell::test
