// A hundred calibrations of one lens: it is right, and its covariance says how right.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "firmware/calibration/lens_trials.hpp"

namespace lightwell::shown {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(HundredCalibrations, KnowHowRightTheyAre) {
  const Trials trials = lens_trials(calibration::LensKind::kannala_brandt, 100, {});
  EXPECT_EQ(trials.failed, 0);
  for (std::size_t i = 0; i < trials.within_3_sigma.size(); ++i)
    EXPECT_GE(trials.within_3_sigma[i], 95) << "number " << i << " of the model, within three deviations";
  // A hundred errors tell their RMS to 7 %.
  EXPECT_NEAR(trials.normalized_direction, 1, 0.1);
  for (const double e : trials.normalized) EXPECT_NEAR(e, 1, 0.2);
  EXPECT_EQ(trials.shaped, 0) << "a flat board is taken as flat";
  EXPECT_LT(*std::max_element(trials.focal.begin(), trials.focal.end()), 1e-3);
  EXPECT_LT(*std::max_element(trials.direction_rad.begin(), trials.direction_rad.end()), 0.05 * kDegree);
}

TEST(FortyCalibrations, KnowHowRightTheyAreThoughCornersOfATagGoTogether) {
  const Trials trials = lens_trials(calibration::LensKind::kannala_brandt, 40, {.noise = Noise::within_tag});
  EXPECT_EQ(trials.failed, 0);
  // Forty errors tell their RMS to 11 %; taken as independent the corners would make it 1.6.
  EXPECT_NEAR(trials.normalized_direction, 1, 0.25);
  for (const double e : trials.normalized) EXPECT_LT(e, 1.4);
}

TEST(TwentyPairs, KnowHowRightTheyAre) {
  const Trials trials = pair_trials(20, {.pictures = 40});
  EXPECT_EQ(trials.failed, 0);
  // Of twenty, one may be beyond: three deviations hold 99.7 % each.
  for (std::size_t i = 0; i < 6; ++i) EXPECT_GE(trials.pair_within_3_sigma[i], 19) << "number " << i << " of the pair";
  for (const PairError& e : trials.pair) {
    EXPECT_LT(e.turn_rad, 0.1 * kDegree);
    EXPECT_LT(e.shift_m, 1e-3);
  }
}

}  // namespace
}  // namespace lightwell::shown
