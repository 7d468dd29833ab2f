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
  explicit LampScene(double alpha = kAlpha, double radius_rad = 0.1, double radiance = 20) {
    const ref::Panorama env =
        ref::lamps_on_gradient(256, 128, {0.3, 0.3, 0.3}, {0.3, 0.3, 0.3},
                               {{ref::world_from_plane(kLamp), radius_rad, {radiance, radiance, radiance}}});
    irradiance = ref::luminance(ref::plane_irradiance(env));
    const ref::SpecularTable table(env, ref::Gloss{alpha});
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

/// Continues until the end, in steps of this size. Returns the operations of each step.
std::vector<std::size_t> finish_in_steps(GlossEstimator& estimator, std::size_t operations) {
  std::vector<std::size_t> out;
  while (estimator.running()) out.push_back(estimator.step(operations));
  return out;
}

void expect_equal(const GlossEstimate& a, const GlossEstimate& b) {
  EXPECT_EQ(a.environment.radiance, b.environment.radiance);
  EXPECT_EQ(a.environment.confidence, b.environment.confidence);
  EXPECT_EQ(a.environment.lower_bound, b.environment.lower_bound);
  EXPECT_EQ(a.glossy, b.glossy);
  EXPECT_EQ(a.common, b.common);
  EXPECT_EQ(a.plane, b.plane);
  EXPECT_EQ((std::array{a.alpha, a.seen, a.saturated, a.recovered, a.scale_sigma, a.guessed, a.misfit}),
            (std::array{b.alpha, b.seen, b.saturated, b.recovered, b.scale_sigma, b.guessed, b.misfit}));
}

class GlossEstimatorSteps : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<LampScene>();
    half_ = std::make_unique<Lumisphere>(scene_->lumisphere);
    for (std::size_t node = 0; node < half_->value.size(); ++node)
      if (half_->grid.direction(node).x < 0) half_->weight[node] = 0;
    diffuse_ = texels(scene_->irradiance, scene_->common);
  }
  static void TearDownTestSuite() { scene_.reset(), half_.reset(), diffuse_.clear(); }

  static inline std::unique_ptr<LampScene> scene_;
  static inline std::unique_ptr<Lumisphere> half_;  ///< The same, of which only one half was seen.
  static inline TexelImage diffuse_;
};

TEST_F(GlossEstimatorSteps, OfAnySizeGiveTheSame) {
  struct Case {
    const Lumisphere* input;
    RoughnessMode mode;
  };
  const Case cases[] = {{half_.get(), RoughnessMode::track},
                        {half_.get(), RoughnessMode::search},
                        {&scene_->lumisphere, RoughnessMode::track}};
  GlossEstimator whole;
  std::vector<GlossEstimate> expected;
  for (const Case& c : cases) {
    whole.begin(*c.input, diffuse_, {}, c.mode);
    whole.step(WorkBudget::kUnlimited);
    ASSERT_FALSE(whole.running());
    ASSERT_TRUE(whole.last() != nullptr && whole.last()->glossy);
    expected.push_back(*whole.last());
  }
  EXPECT_NE(expected[0].environment.radiance, expected[1].environment.radiance);
  EXPECT_NE(expected[1].environment.radiance, expected[2].environment.radiance);
  std::vector<std::size_t> total(expected.size());
  for (const std::size_t operations : {std::size_t{1}, std::size_t{777'777}, std::size_t{20'000'000}}) {
    GlossEstimator steps;
    for (std::size_t k = 0; k < expected.size(); ++k) {
      steps.begin(*cases[k].input, diffuse_, {}, cases[k].mode);
      const std::vector<std::size_t> spent = finish_in_steps(steps, operations);
      EXPECT_GT(spent.size(), 2U);
      ASSERT_NE(steps.last(), nullptr);
      expect_equal(*steps.last(), expected[k]);
      const std::size_t sum = std::accumulate(spent.begin(), spent.end(), std::size_t{0});
      if (operations == 1)
        total[k] = sum;
      else
        EXPECT_EQ(sum, total[k]) << "the work is divided, not repeated";
    }
  }
  EXPECT_LT(3 * total[0], total[1]) << "one roughness instead of seven";
}

TEST_F(GlossEstimatorSteps, AreBounded) {
  GlossEstimator estimator;
  EXPECT_EQ(estimator.step(1'000'000), 0U) << "there is nothing to do";
  // A row of the operator is computed as a whole: 313 coarse cells and at most a third of the 7,321 fine ones with up
  // to 16 azimuths, ten operations each, would be four times this; grazing directions, which have 16, have fewer cells.
  constexpr std::size_t kRow = 200'000;
  for (const std::size_t operations : {std::size_t{1}, GlossEstimator::kMaxPart, std::size_t{5'000'000}}) {
    estimator.begin(*half_, diffuse_, {}, RoughnessMode::search);
    const std::vector<std::size_t> spent = finish_in_steps(estimator, operations);
    EXPECT_GT(spent.size(), 10U);
    EXPECT_LE(*std::ranges::max_element(spent), std::max(operations, GlossEstimator::kMaxPart) + kRow);
    EXPECT_GT(*std::ranges::min_element(spent), 0U) << "every step makes progress";
  }
}

// The limit of a part holds at any roughness: the operator has most coefficients where the grid is finest and the
// lobe widest.
TEST(GlossSolver, PartsOfAnyRoughnessAreBounded) {
  const LampScene scene;
  GlossInput input{scene.lumisphere, *diffuse_range(texels(scene.irradiance, scene.common)), {}};
  for (const double alpha : {RoughnessSearch::kMinAlpha, 0.03, 0.0404, 0.05, 0.1, RoughnessSearch::kMaxAlpha}) {
    GlossSolver solver;
    solver.begin(input, alpha, 2);
    bool done = false;
    std::size_t largest = 0;
    while (!done) {
      WorkBudget one_part(1);
      done = solver.step(one_part);
      largest = std::max(largest, one_part.spent());
    }
    EXPECT_LE(largest, GlossEstimator::kMaxPart) << alpha;
    EXPECT_GT(largest, GlossEstimator::kMaxPart / 10) << alpha;
  }
}

TEST_F(GlossEstimatorSteps, WhatIsCapturedMeanwhileDoesNotMix) {
  GlossEstimator estimator, other;
  const GlossEstimate expected = *other.estimate(*half_, diffuse_, {});
  Lumisphere captured = *half_;
  TexelImage diffuse = diffuse_;
  estimator.begin(captured, diffuse, {}, RoughnessMode::search);
  for (int k = 0; estimator.running(); ++k) {
    // Frames change everything, after some steps to values that no estimate survives.
    captured = k < 3 ? scene_->lumisphere : Lumisphere(2);
    for (Radiance& r : captured.value) r = {std::nanf(""), 1, 1};
    diffuse.assign(k < 3 ? diffuse.size() : 1, TexelRadiance{std::nanf(""), 0, 0, 0});
    estimator.step(5'000'000);
  }
  ASSERT_NE(estimator.last(), nullptr);
  expect_equal(*estimator.last(), expected);
}

TEST_F(GlossEstimatorSteps, TheLastEstimateIsValidWhileAnotherRuns) {
  GlossEstimator estimator;
  const GlossEstimate first = *estimator.estimate(*half_, diffuse_, {});
  estimator.begin(scene_->lumisphere, diffuse_, {}, RoughnessMode::track);
  int steps = 0;
  for (; estimator.running(); ++steps) {
    ASSERT_NE(estimator.last(), nullptr);
    expect_equal(*estimator.last(), first);
    estimator.step(20'000'000);
  }
  EXPECT_GT(steps, 2);
  EXPECT_NE(estimator.last()->environment.radiance, first.environment.radiance);
  // An unfinished estimate is replaced.
  GlossEstimator replaced;
  replaced.begin(scene_->lumisphere, diffuse_, {}, RoughnessMode::track);
  replaced.step(1);
  ASSERT_TRUE(replaced.running());
  EXPECT_EQ(replaced.last(), nullptr);
  expect_equal(*replaced.estimate(*half_, diffuse_, {}), first);
  // So is a glossy one by a matte one, in no step.
  replaced.begin(scene_->lumisphere, diffuse_, {}, RoughnessMode::track);
  ASSERT_TRUE(replaced.running());
  replaced.begin(lumisphere_of(0), diffuse_, {}, RoughnessMode::track);
  EXPECT_FALSE(replaced.running());
  EXPECT_FALSE(replaced.last()->glossy);
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

/// Evaluations until the search is done, for a misfit that reaches the expected one at `truth`.
int evaluations(RoughnessSearch search, double truth) {
  int out = 0;
  for (; !search.done() && out < 100; ++out) {
    EXPECT_GE(search.alpha(), RoughnessSearch::kMinAlpha * 0.999);
    EXPECT_LE(search.alpha(), RoughnessSearch::kMaxAlpha * 1.001);
    search.add(search.alpha() / truth);
  }
  EXPECT_TRUE(search.done());
  // The middle of its cell, or of the first or last one where it is outside of the range.
  const double width = std::log(RoughnessSearch::kMaxAlpha / RoughnessSearch::kMinAlpha) / RoughnessSearch::kCells;
  const double inside = std::clamp(truth, RoughnessSearch::kMinAlpha, RoughnessSearch::kMaxAlpha);
  EXPECT_LE(std::abs(std::log(search.alpha() / inside)), 0.501 * width) << truth;
  return out;
}

TEST(RoughnessSearch, FindsTheRootFromAnyStart) {
  for (const double truth : {0.001, 0.0201, 0.0213, 0.03, 0.1001, 0.25, 0.487, 0.499, 3.0}) {
    EXPECT_EQ(evaluations(RoughnessSearch(), truth), 6);
    for (const double start : {0.001, 0.02, 0.0205, 0.05, 0.1, 0.2, 0.49, 0.5, 1.0})
      // Out and back, at most twice the logarithm of 64 cells.
      EXPECT_LE(evaluations(RoughnessSearch(start), truth), 12) << start << " to " << truth;
    EXPECT_LE(evaluations(RoughnessSearch(std::clamp(truth, 0.02, 0.5)), truth), 2);
  }
}

}  // namespace
}  // namespace lightwell::specular
