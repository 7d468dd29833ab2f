// Repeated calibrations of one lens: the errors are small and consistent with the covariance. `tests/figures cameras`
// repeats them a hundred times with every model.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "firmware/calibration/lens_trials.hpp"

namespace lightwell::shown {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(LensTrials, HaveAConsistentCovariance) {
  constexpr int kTrials = 30;
  const Trials trials = lens_trials(calibration::LensKind::kannala_brandt, kTrials, {});
  EXPECT_EQ(trials.failed, 0);
  for (std::size_t i = 0; i < trials.within_3_sigma.size(); ++i)
    EXPECT_GE(trials.within_3_sigma[i], kTrials - 2)
        << "model parameter " << i << ": number of trials within three standard deviations";
  // The RMS of thirty errors has a standard deviation of 13 %.
  EXPECT_NEAR(trials.normalized_direction, 1, 0.2);
  for (const double e : trials.normalized) EXPECT_NEAR(e, 1, 0.35);
  EXPECT_EQ(trials.shaped, 0) << "no shape may be estimated for a flat board";
  EXPECT_LT(*std::max_element(trials.focal.begin(), trials.focal.end()), 1e-3);
  EXPECT_LT(*std::max_element(trials.direction_rad.begin(), trials.direction_rad.end()), 0.05 * kDegree);
}

TEST(LensTrials, HaveAConsistentCovarianceWithCorrelatedCorners) {
  const Trials trials = lens_trials(calibration::LensKind::kannala_brandt, 12, {.noise = Noise::within_tag});
  EXPECT_EQ(trials.failed, 0);
  // The RMS of twelve errors has a standard deviation of 20 %; if corners were assumed independent, it would be 1.6.
  EXPECT_NEAR(trials.normalized_direction, 1, 0.35);
  for (const double e : trials.normalized) EXPECT_LT(e, 1.4);
}

TEST(PairTrials, HaveAConsistentCovariance) {
  const Trials trials = pair_trials(3, {.pictures = 40});
  EXPECT_EQ(trials.failed, 0);
  // Three standard deviations contain 99.7 % each.
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(trials.pair_within_3_sigma[i], 3) << "pair parameter " << i;
  for (const PairError& e : trials.pair) {
    EXPECT_LT(e.turn_rad, 0.1 * kDegree);
    EXPECT_LT(e.shift_m, 1e-3);
  }
}

}  // namespace
}  // namespace lightwell::shown
