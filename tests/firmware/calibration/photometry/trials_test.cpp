// Repeated photometric calibrations of a known simulated camera: errors, and consistency of the standard deviations.
// The thresholds are requirements; reasons are stated beside them.
#include "firmware/calibration/photometry/trials.hpp"

#include <map>

#include <gtest/gtest.h>

namespace lightwell::photometry {
namespace {

/// Three standard deviations must contain at least 95 % of the trials (99.7 % for a Gaussian). `tests/figures cameras`
/// makes a hundred of each.
constexpr int kTrials = 40;
constexpr double kInside = 0.95;

std::map<std::string, ParameterFigure> by_name(const std::vector<ParameterFigure>& figures) {
  std::map<std::string, ParameterFigure> out;
  for (const ParameterFigure& f : figures) {
    out[f.name] = f;
    testing::Test::RecordProperty(f.name + "_worst", std::to_string(f.worst));
    testing::Test::RecordProperty(f.name + "_inside", std::to_string(f.inside));
  }
  return out;
}

class ResponseTrials : public testing::TestWithParam<ResponseCase> {};

TEST_P(ResponseTrials, TheCurveIsWithinOnePercentAndItsUncertaintyConsistent) {
  auto figures = by_name(response_trials(GetParam(), kTrials));
  // One percent of full scale: the permitted error of the total light.
  EXPECT_LE(figures["curve"].worst, 0.01);
  EXPECT_EQ(figures["curve"].trials, kTrials);
  for (const char* name : {"worst_knot", "gamma"}) {
    if (figures.count(name) != 0) {
      EXPECT_GE(figures[name].inside, kInside) << name;
    }
  }
  // The kind of curve may occasionally be confused with one that is equal within half a level.
  EXPECT_GE(figures["kind"].inside, 0.9);
}

INSTANTIATE_TEST_SUITE_P(Curves, ResponseTrials,
                         testing::Values(ResponseCase::srgb8, ResponseCase::gamma8, ResponseCase::toe8,
                                         ResponseCase::linear12, ResponseCase::gamma12, ResponseCase::toe12),
                         [](const auto& tested) { return std::string(to_string(tested.param)); });

class NoiseTrials : public testing::TestWithParam<int> {};

TEST_P(NoiseTrials, BlackIsWithinAThousandthAndNoiseWithinFivePercent) {
  auto figures = by_name(noise_trials(GetParam(), kTrials));
  // A thousandth of full scale: a quarter of an 8-bit level.
  EXPECT_LE(figures["black"].worst, 0.001);
  // The noise model is used for weights; an error of five percent is negligible there.
  for (const char* name : {"read", "read_noise", "shot_noise"}) EXPECT_LE(figures[name].worst, 0.05) << name;
  for (const char* name : {"black", "read", "read_noise", "shot_noise"})
    EXPECT_GE(figures[name].inside, kInside) << name;
}

INSTANTIATE_TEST_SUITE_P(Bits, NoiseTrials, testing::Values(8, 12));

TEST(VignettingTrials, TheCurveIsWithinOnePercentUpToTheEdge) {
  auto figures = by_name(vignetting_trials(kTrials));
  EXPECT_LE(figures["edge"].worst, 0.01);
  for (const char* name : {"v1", "v2", "v3"}) EXPECT_GE(figures[name].inside, kInside) << name;
}

class CardTrials : public testing::TestWithParam<int> {};

TEST_P(CardTrials, WhiteBalanceIsWithinHalfAPercent) {
  auto figures = by_name(card_trials(GetParam(), kTrials));
  // Half a percent: an invisible colour difference.
  for (const char* name : {"red", "blue"}) EXPECT_LE(figures[name].worst, 0.005) << name;
  EXPECT_LE(figures["scale"].worst, 0.005) << "without the error of the meter";
  for (const char* name : {"red", "blue", "scale"}) EXPECT_GE(figures[name].inside, kInside) << name;
}

INSTANTIATE_TEST_SUITE_P(Bits, CardTrials, testing::Values(8, 12));

}  // namespace
}  // namespace lightwell::photometry
