// GlossEstimator in steps: any size gives the same result, each is bounded, and captures meanwhile do not mix in.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "gloss_scenes.hpp"

namespace lightwell::specular {
namespace {

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

}  // namespace
}  // namespace lightwell::specular
