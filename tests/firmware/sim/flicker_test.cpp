// Tests of MainsFlicker: closed form against numerical integration.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/scene.hpp"

namespace lightwell::sim {
namespace {

double integrated(const MainsFlicker& f, double middle_s, double exposure_s) {
  constexpr int kSteps = 20000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double t = middle_s + ((i + 0.5) / kSteps - 0.5) * exposure_s;
    sum += 1 + f.depth * std::sin(2 * std::numbers::pi * f.hz * t);
  }
  return sum / kSteps;
}

TEST(MainsFlicker, IsTheMeanOfASinusoidOverTheExposure) {
  for (const double hz : {100.0, 120.0}) {
    for (const double exposure_s : {1e-6, 1e-4, 0.003, 0.0083, 0.02, 0.033}) {
      for (const double middle_s : {-0.3, 0.0, 0.0021, 0.7, 12.3456}) {
        const MainsFlicker f{hz, 0.4};
        EXPECT_NEAR(f.factor(middle_s, exposure_s), integrated(f, middle_s, exposure_s), 1e-8);
      }
    }
  }
}

TEST(MainsFlicker, WholePeriodsCancelItAndInstantsShowItFully) {
  const MainsFlicker f{100, 0.3};
  for (const double middle_s : {0.0, 0.0017, 0.0025, 5.123}) {
    EXPECT_NEAR(f.factor(middle_s, 0.01), 1, 1e-12);
    EXPECT_NEAR(f.factor(middle_s, 0.03), 1, 1e-12);
  }
  EXPECT_NEAR(f.factor(0.0025, 0), 1.3, 1e-12) << "a quarter of a period";
  EXPECT_NEAR(f.factor(0.0075, 0), 0.7, 1e-12);
}

TEST(MainsFlicker, WithoutFlickerTheFactorIsOne) {
  EXPECT_EQ(MainsFlicker{}.factor(0.123, 0.004), 1);
  EXPECT_EQ((MainsFlicker{0, 0.3}.factor(0.123, 0.004)), 1);
  EXPECT_EQ((MainsFlicker{100, 0}.factor(0.123, 0.004)), 1);
}

}  // namespace
}  // namespace lightwell::sim
