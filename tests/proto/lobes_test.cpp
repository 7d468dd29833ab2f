#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/lobes.hpp>

#include "reference/ggx.hpp"
#include "reference/harmonics.hpp"

namespace lightwell {
namespace {

namespace ref = reference;

TEST(CosineLobe, IsTheIntegralOfTheClampedCosineInEveryBand) {
  for (int l = 0; l <= kMaxBasisBand; ++l) EXPECT_NEAR(cosine_lobe(l), ref::cosine_lobe_by_quadrature(l), 1e-9) << l;
}

TEST(GgxLobe, MatchesTheOracleAtEveryRoughness) {
  for (const double r : {0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.999, 1.0}) {
    const GgxLobe lobe(r);
    const ref::GgxKernel truth(r);
    for (const double x : {1.0, 0.9999, 0.99, 0.9, 0.5, 0.1, 1e-3})
      EXPECT_NEAR(lobe.value(x), truth.at_cosine(x), 1e-8 * truth.at_cosine(1)) << "r " << r << " x " << x;
  }
}

TEST(GgxLobe, LegendreCoefficientsMatchTheOracle) {
  for (const double r : {0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0}) {
    const auto k = GgxLobe(r).coefficients();
    const std::vector<double> truth = ref::ggx_legendre(r, kMaxBand);
    // The specification requires 1e-5; quadrature with 32 nodes is far more accurate.
    for (int l = 0; l <= kMaxBand; ++l)
      EXPECT_NEAR(k[static_cast<std::size_t>(l)], truth[static_cast<std::size_t>(l)], 1e-8) << "r " << r << " l " << l;
  }
}

TEST(GgxLobe, IsZeroBelowTheHorizon) {
  const GgxLobe lobe(0.7);
  EXPECT_EQ(lobe.value(0), 0);
  EXPECT_EQ(lobe.value(-0.5), 0);
}

TEST(GgxLobe, ClampsRoughness) {
  EXPECT_EQ(GgxLobe(-1).value(1), GgxLobe(GgxLobe::kMinRoughness).value(1));
  EXPECT_EQ(GgxLobe(7).value(1), GgxLobe(1).value(1));
  EXPECT_EQ(GgxLobe(std::numeric_limits<double>::quiet_NaN()).value(1), GgxLobe(1).value(1));
  EXPECT_EQ(GgxLobe(std::numeric_limits<double>::infinity()).value(1), GgxLobe(1).value(1));
}

}  // namespace
}  // namespace lightwell
