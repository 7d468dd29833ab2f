// GlossEstimator: roughness, scale and environment of a separated reflection; matte planes; extremes.
#include "estimate/specular/gloss_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "gloss_scenes.hpp"

namespace lightwell::specular {
namespace {

namespace ref = reference;

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

TEST(GlossEstimator, PredictsTheEdgeOfALightBetweenTwoTurnsOfThePath) {
  constexpr double kRadius = 0.4, kEdgeElevation = std::numbers::pi / 4 + kRadius, kHalfGap = 0.12;
  const LampScene scene(kAlpha, kRadius, 2);
  Lumisphere seen = scene.lumisphere;
  for (std::size_t node = 0; node < seen.value.size(); ++node)
    if (std::abs(std::asin(seen.grid.direction(node).z) - kEdgeElevation) < kHalfGap) seen.weight[node] = 0;
  fill_unseen(seen);
  GlossEstimator estimator;
  const GlossEstimate* e = estimator.estimate(seen, texels(scene.irradiance, scene.common), {});
  ASSERT_NE(e, nullptr);
  double predicted = 0, of_neighbours = 0;
  for (std::size_t node = 0; node < seen.value.size(); ++node) {
    if (seen.weight[node] > 0 || !(scene.lumisphere.weight[node] > 0)) continue;
    const double truth = static_cast<double>(scene.lumisphere.value[node].g);
    predicted +=
        std::pow(static_cast<double>(e->predicted(vec_cast<float>(seen.grid.direction(node))).value().g) - truth, 2);
    of_neighbours += std::pow(static_cast<double>(seen.value[node].g) - truth, 2);
  }
  EXPECT_LT(std::sqrt(predicted), 0.6 * std::sqrt(of_neighbours));
}

TEST(GlossEstimator, PredictsNothingWhileTheRoughnessIsAGuessOrThePlaneIsMatte) {
  const LampScene scene;
  GlossEstimator estimator;
  Lumisphere few = scene.lumisphere;
  for (std::size_t node = 0; node < few.value.size(); ++node) {
    const Vec3d d = few.grid.direction(node);
    if (ref::angle_deg({-d.x, -d.y, d.z}, kLamp) > 30) few.weight[node] = 0;
  }
  estimator.begin(few, texels(scene.irradiance, scene.common), {}, RoughnessMode::track);
  estimator.step(WorkBudget::kUnlimited);
  ASSERT_TRUE(estimator.last()->glossy && estimator.last()->provisional);
  EXPECT_FALSE(estimator.last()->predicted({0, 0, 1}));
  EXPECT_FALSE(estimator.estimate(lumisphere_of(0), texels(2), {})->predicted({0, 0, 1}));
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

// Metal: it reflects ten times as much as the gloss of specular_brdf.hpp, and its texture shows the true irradiance.
TEST(GlossEstimator, MoreLightThanTheTextureShowsHasAnUncertainScale) {
  LampScene scene;
  for (Radiance& r : scene.lumisphere.value) r = r * 10;
  GlossEstimator estimator;
  const GlossEstimate* e = estimator.estimate(scene.lumisphere, texels(scene.irradiance, scene.common), {});
  ASSERT_NE(e, nullptr);
  expect_numbers(*e);
  // Less than ten times: the uniform radiance was subtracted with the least value, and is not multiplied.
  EXPECT_GT(total(*e), 3 * scene.irradiance);
  EXPECT_GT(total(*e) / scene.irradiance - 1, 0.9 * e->scale_sigma);
  EXPECT_LT(total(*e) / scene.irradiance - 1, 1.2 * e->scale_sigma);
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

TEST(GlossEstimator, TracksTheRoughness) {
  const LampScene smooth(kAlpha / 2), rough(kAlpha);
  const TexelImage diffuse = texels(smooth.irradiance, smooth.common);
  GlossEstimator tracking, searching;
  const double found = searching.estimate(smooth.lumisphere, diffuse, {})->alpha;
  EXPECT_GT(found, kAlpha / 2 / 1.5);
  EXPECT_LT(found, kAlpha / 2 * 1.5);
  const auto track = [&](const Lumisphere& lumisphere) -> const GlossEstimate& {
    tracking.begin(lumisphere, diffuse, {}, RoughnessMode::track);
    tracking.step(WorkBudget::kUnlimited);
    return *tracking.last();
  };
  Lumisphere few = smooth.lumisphere, half = smooth.lumisphere;
  for (std::size_t node = 0; node < few.value.size(); ++node) {
    const Vec3d d = few.grid.direction(node);
    if (d.x < 0.6) few.weight[node] = 0;
    if (d.x < 0) half.weight[node] = 0;
  }
  for (int k = 0; k < 3; ++k) {
    const GlossEstimate& e = track(few);
    EXPECT_LT(e.seen, 0.25);
    EXPECT_EQ(e.alpha, 0.1) << "too little was seen";
    EXPECT_TRUE(e.provisional);
  }
  for (int k = 0; k < 6; ++k) EXPECT_TRUE(track(half).provisional) << "an evaluation of the search";
  const double alpha = track(half).alpha;
  EXPECT_FALSE(tracking.last()->provisional);
  EXPECT_EQ(track(half).alpha, alpha) << "nothing more was seen";
  // More was seen: it stays within the cells of the search, 5 % wide, where the misfit agrees, and follows it
  // otherwise.
  track(smooth.lumisphere);
  for (int k = 0; k < 8; ++k) EXPECT_FALSE(track(smooth.lumisphere).provisional);
  // The common radiance was fitted in other rounds: by a cell more.
  EXPECT_LT(std::abs(std::log(tracking.last()->alpha / found)), 0.11);
  GlossEstimator other;
  EXPECT_GT(other.estimate(rough.lumisphere, diffuse, {})->alpha, 1.3 * found);
}

}  // namespace
}  // namespace lightwell::specular
