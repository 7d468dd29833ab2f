// GlossEstimator: roughness, scale and environment of a separated reflection; matte planes; extremes.
#include "estimate/specular/gloss_estimate.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "reference/glossy_plane.hpp"
#include "reference/glossy_sequence.hpp"

namespace lightwell::specular {
namespace {

namespace ref = reference;

constexpr double kAlpha = 0.1;
const ref::V3 kLamp{std::sqrt(0.5), 0, std::sqrt(0.5)};

/// Texels of albedo 0.03 to 0.8 under an irradiance, plus a part that is specular.
TexelImage texels(double irradiance, float common = 0) {
  TexelImage out;
  for (int k = 0; k < 1024; ++k) {
    const double albedo = k % 4 == 0 ? 0.8 : k % 4 == 1 ? 0.03 : 0.03 + 0.77 * k / 1024;
    const auto value = static_cast<float>(albedo / std::numbers::pi * irradiance) + common;
    out.push_back({value, value, value, 0});
  }
  return out;
}

/// Every direction above 5 degrees is seen, with a specular part of this radiance.
Lumisphere lumisphere_of(float radiance) {
  Lumisphere out(60);
  for (std::size_t node = 0; node < out.value.size(); ++node) {
    if (out.grid.direction(node).z < 0.09) continue;
    out.value[node] = {radiance, radiance, radiance};
    out.weight[node] = 100, out.sigma[node] = 0.001F;
  }
  return out;
}

/// The reflection of a lamp on uniform radiance, less its least value.
struct LampScene {
  LampScene() {
    const ref::Panorama env = ref::lamps_on_gradient(256, 128, {0.3, 0.3, 0.3}, {0.3, 0.3, 0.3},
                                                     {{ref::world_from_plane(kLamp), 0.1, {20, 20, 20}}});
    irradiance = ref::luminance(ref::plane_irradiance(env));
    const ref::SpecularTable table(env, ref::Gloss{kAlpha});
    common = std::numeric_limits<float>::infinity();
    for (std::size_t node = 0; node < lumisphere.value.size(); ++node) {
      const Vec3d d = lumisphere.grid.direction(node);
      if (!(lumisphere.weight[node] > 0)) continue;
      const auto s = static_cast<float>(table.radiance({d.x, d.y, d.z})[1]);
      lumisphere.value[node] = {s, s, s};
      common = std::min(common, s);
    }
    for (std::size_t node = 0; node < lumisphere.value.size(); ++node)
      if (lumisphere.weight[node] > 0) lumisphere.value[node] += Radiance{-common, -common, -common};
  }
  Lumisphere lumisphere = lumisphere_of(0);
  double irradiance = 0;
  float common = 0;
};

double total(const GlossEstimate& estimate) { return double{plane_irradiance(estimate.environment).luminance()}; }

void expect_numbers(const GlossEstimate& e) {
  for (const Radiance& r : e.environment.radiance)
    for (int c = 0; c < 3; ++c) ASSERT_TRUE(std::isfinite(r[c]) && r[c] >= 0);
  for (const double share : {e.seen, e.saturated, e.recovered, e.guessed}) {
    EXPECT_GE(share, 0);
    EXPECT_LE(share, 1);
  }
  for (const double number : {e.alpha, e.scale_sigma, e.misfit, total(e)}) EXPECT_TRUE(std::isfinite(number));
  for (int c = 0; c < 3; ++c) EXPECT_TRUE(std::isfinite(e.common[c]) && std::isfinite(e.plane[c]));
}

TEST(GlossEstimator, FindsRoughnessScaleAndLamp) {
  const LampScene scene;
  GlossEstimator estimator;
  const GlossEstimate* e = estimator.estimate(scene.lumisphere, texels(scene.irradiance, scene.common), {});
  ASSERT_NE(e, nullptr);
  expect_numbers(*e);
  EXPECT_TRUE(e->glossy);
  EXPECT_EQ(e->saturated, 0);
  EXPECT_EQ(e->recovered, 0);
  EXPECT_EQ(e->seen, 1);
  // The misfit determines the roughness to some tens of percent.
  EXPECT_GT(e->alpha, kAlpha / 1.5);
  EXPECT_LT(e->alpha, kAlpha * 1.5);
  EXPECT_NEAR(total(*e), scene.irradiance, 0.1 * scene.irradiance);
  EXPECT_NEAR(total(*e), scene.irradiance, 3 * e->scale_sigma * total(*e) + 0.05 * scene.irradiance);
  std::size_t brightest = 0;
  for (std::size_t cell = 0; cell < e->environment.radiance.size(); ++cell)
    if (e->environment.radiance[cell].g > e->environment.radiance[brightest].g) brightest = cell;
  const Vec3d d = e->environment.grid.direction(brightest);
  EXPECT_LT(ref::angle_deg({d.x, d.y, d.z}, kLamp), 3) << "a cell is 3 degrees wide";
}

TEST(GlossEstimator, AMattePlaneIsNotGlossy) {
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 0.0004F);
  const TexelImage diffuse = texels(2);
  Lumisphere zero = lumisphere_of(0), noisy = zero;
  for (std::size_t node = 0; node < noisy.value.size(); ++node)
    if (noisy.weight[node] > 0) noisy.value[node] = noisy.value[node] + Radiance{1, 1, 1} * std::abs(noise(random));
  for (const Lumisphere* lumisphere : {&zero, &noisy}) {
    GlossEstimator estimator;
    const GlossEstimate* e = estimator.estimate(*lumisphere, diffuse, {});
    ASSERT_NE(e, nullptr);
    expect_numbers(*e);
    EXPECT_FALSE(e->glossy);
    EXPECT_EQ(e->guessed, 1);
    EXPECT_NEAR(e->scale_sigma, 0.1 / 0.8, 1e-9);
    const float bright = diffuse.front().g;
    // A sum over a hemisphere of eight levels.
    const double expected = std::numbers::pi * double{bright} / 0.8;
    EXPECT_NEAR(total(*e), expected, 0.02 * expected);
    for (const Radiance& r : e->environment.radiance) EXPECT_EQ(r.g, e->environment.radiance.front().g);
  }
}

TEST(GlossEstimator, AfterAMattePlaneAGlossyOneIsFound) {
  const LampScene scene;
  const TexelImage diffuse = texels(scene.irradiance, scene.common);
  GlossEstimator estimator;
  const GlossEstimate* e = estimator.estimate(lumisphere_of(0), diffuse, {});
  ASSERT_NE(e, nullptr);
  EXPECT_FALSE(e->glossy);
  e = estimator.estimate(scene.lumisphere, diffuse, {});
  ASSERT_NE(e, nullptr);
  EXPECT_TRUE(e->glossy);
  EXPECT_NEAR(total(*e), scene.irradiance, 0.1 * scene.irradiance);
  e = estimator.estimate(lumisphere_of(0), diffuse, {});
  ASSERT_NE(e, nullptr);
  EXPECT_FALSE(e->glossy);
  EXPECT_EQ(e->common.g, 0);
  EXPECT_EQ(e->saturated, 0);
  EXPECT_EQ(e->recovered, 0);
}

TEST(GlossEstimator, NothingSeenIsNoEstimate) {
  GlossEstimator estimator;
  EXPECT_EQ(estimator.estimate(lumisphere_of(0), {}, {}), nullptr);
  EXPECT_EQ(estimator.estimate(lumisphere_of(0), TexelImage(1024), {}), nullptr) << "texels that nobody saw";
  TexelImage few(1024);
  for (std::size_t k = 0; k < 99; ++k) few[k] = {1, 1, 1, 0};
  EXPECT_EQ(estimator.estimate(lumisphere_of(0), few, {}), nullptr);
  EXPECT_EQ(uniform_estimate(few, {}), std::nullopt);
  EXPECT_EQ(estimator.estimate(Lumisphere(60), texels(2), {}), nullptr) << "no direction was seen";
  ASSERT_NE(estimator.estimate(lumisphere_of(0), texels(2), {}), nullptr);
}

TEST(GlossEstimator, ExtremesGiveNumbers) {
  const LampScene scene;
  Lumisphere saturated = scene.lumisphere, one = lumisphere_of(0), negative = scene.lumisphere;
  for (auto& clipped : saturated.clipped) clipped = 1;
  for (std::size_t node = 1; node < one.value.size(); ++node) one.weight[node] = 0;
  for (Radiance& r : negative.value) r = r * -1.0F;
  for (const Lumisphere* lumisphere : {&saturated, &one, &negative})
    for (const double irradiance : {scene.irradiance, 0.0, 1e6}) {
      GlossEstimator estimator;
      const GlossEstimate* e = estimator.estimate(*lumisphere, texels(irradiance), {});
      if (e != nullptr) expect_numbers(*e);
    }
}

/// Cuts the reflection off at a share of its peak.
void saturate(Lumisphere& lumisphere, float share) {
  float peak = 0;
  for (const Radiance& r : lumisphere.value) peak = std::max(peak, r.g);
  const float limit = share * peak;
  for (std::size_t node = 0; node < lumisphere.value.size(); ++node)
    if (lumisphere.value[node].g > limit) {
      lumisphere.value[node] = {limit, limit, limit};
      lumisphere.clipped[node] = 1;
    }
}

TEST(GlossEstimator, IrradianceOfSaturatedLightIsThatOfTheTexture) {
  for (const float share : {0.4F, 0.1F}) {
    LampScene scene;
    saturate(scene.lumisphere, share);
    GlossEstimator estimator;
    const GlossEstimate* e = estimator.estimate(scene.lumisphere, texels(scene.irradiance, scene.common), {0.8, 0.02});
    ASSERT_NE(e, nullptr);
    expect_numbers(*e);
    EXPECT_GT(e->saturated, 0);
    // That of the white texels. What is left are the errors of the common part.
    EXPECT_NEAR(total(*e), scene.irradiance, 0.15 * scene.irradiance) << share;
  }
}

// Black texels say that nothing is common: what the texture shows and the reflection lacks is saturated light.
TEST(GlossEstimator, SaturatedLightIsRecoveredFromTheTexture) {
  LampScene scene;
  saturate(scene.lumisphere, 0.1F);
  TexelImage with_black = texels(scene.irradiance);
  for (std::size_t k = 1; k < with_black.size(); k += 4) with_black[k] = {0, 0, 0, 0};
  GlossEstimator estimator;
  const GlossEstimate* e = estimator.estimate(scene.lumisphere, with_black, {0.8, 0.02});
  ASSERT_NE(e, nullptr);
  expect_numbers(*e);
  EXPECT_GT(e->recovered, 0.3);
  // Exactly the missing part is added.
  EXPECT_NEAR(total(*e), scene.irradiance, 1e-3 * scene.irradiance);
}

}  // namespace
}  // namespace lightwell::specular
