#include "reference/cap.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/cap.hpp>

#include "reference/ggx.hpp"
#include "reference/quadrature.hpp"

namespace lightwell {
namespace {

namespace ref = reference;
constexpr double kPi = std::numbers::pi;

TEST(Cap, IrradianceMatchesTheOracleAcrossTheHorizon) {
  for (const double rho : {1e-3, 0.0047, 0.05, 0.3, 0.8, 1.2, kPi / 2}) {
    for (int i = 0; i <= 180; ++i) {
      const double angle = kPi * i / 180;
      const double truth = ref::cap_irradiance(rho, angle) / ref::cap_vector_irradiance(rho);
      // Tolerance: cancellation of the closed form, 1e-16 / rho².
      EXPECT_NEAR(cap_irradiance(std::cos(angle), rho), truth, 1e-7 + 1e-15 / (rho * rho)) << rho << " at " << i;
    }
  }
}

TEST(Cap, ShrinkingCapConvergesToADirectionalLight) {
  for (const double c : {1.0, 0.5, 1e-3, 0.0, -1e-3, -0.5}) {
    double before = cap_irradiance(c, 1e-3);
    for (double rho = 1e-3; rho > 1e-7; rho *= 0.5) {
      const double now = cap_irradiance(c, rho);
      // At the horizon a small cap that is half visible adds 2 rho / (3 pi); elsewhere nothing changes.
      EXPECT_NEAR(now, before, rho) << c << " " << rho;
      before = now;
    }
    EXPECT_NEAR(cap_irradiance(c, 0), std::max(0.0, c), 1e-15);
  }
}

TEST(Cap, IrradianceIsContinuousAndNonNegativeAtTheHorizon) {
  for (const double rho : {0.01, 0.2, 1.0}) {
    double before = cap_irradiance(std::cos(kPi / 2 - rho - 0.01), rho);
    for (double a = kPi / 2 - rho - 0.01; a < kPi / 2 + rho + 0.01; a += 1e-4) {
      const double now = cap_irradiance(std::cos(a), rho);
      EXPECT_GE(now, 0);
      EXPECT_NEAR(now, before, 1.1e-4) << rho << " " << a;
      before = now;
    }
  }
}

TEST(Cap, HemisphereIrradianceIsHalfOfOnePlusCosine) {
  for (double a = 0; a < kPi; a += 0.1) EXPECT_NEAR(cap_irradiance(std::cos(a), kPi / 2), (1 + std::cos(a)) / 2, 1e-9);
}

TEST(Cap, ZonalCoefficientsAreTheLegendreIntegralOverTheCap) {
  for (const double rho : {1e-6, 1e-4, 0.01, 0.3, kPi / 2}) {
    for (int l = 0; l <= 12; ++l) {
      // Integrate over the angle, because the cosine of a tiny angle loses its digits.
      const auto p = [l](double t) { return std::legendre(static_cast<unsigned>(l), std::cos(t)) * std::sin(t); };
      const double truth = 2 * kPi * ref::integrate(p, 0, rho, 1e-18) / (kPi * std::sin(rho) * std::sin(rho));
      EXPECT_NEAR(cap_zonal(l, rho), truth, 1e-6) << l << " " << rho;
    }
  }
}

TEST(Cap, RadianceIsTheLobeIntegratedOverTheCap) {
  for (const double r : {0.1, 0.3, 0.5, 1.0}) {
    const GgxLobe lobe(r);
    const ref::GgxKernel kernel(r);
    for (const double rho : {0.01, 0.1, 0.4}) {
      for (const double angle : {0.0, 0.05, 0.2, 0.5, 1.0, 1.5, 1.9}) {
        // Brute-force sum over the cap in polar coordinates about its axis.
        constexpr int rings = 400, steps = 400;
        double sum = 0;
        for (int i = 0; i < rings; ++i) {
          const double t = rho * (i + 0.5) / rings;
          for (int j = 0; j < steps; ++j) {
            const double phi = 2 * kPi * (j + 0.5) / steps;
            const double x = std::cos(angle) * std::cos(t) + std::sin(angle) * std::sin(t) * std::cos(phi);
            if (x > 0) sum += kernel.at_cosine(x) * std::sin(t) * (rho / rings) * (2 * kPi / steps);
          }
        }
        const double truth = sum / (kPi * std::sin(rho) * std::sin(rho));
        // The brute-force sum has an error of about 1e-4 where the horizon intersects the cap.
        EXPECT_NEAR(cap_radiance(std::cos(angle), rho, lobe), truth, 2e-4 * kernel.at_cosine(1))
            << r << " " << rho << " " << angle;
      }
    }
  }
}

TEST(Cap, RadiusAndMeanAreInverse) {
  for (const double rho : {0.0, 0.001, 0.1, 1.0}) {
    // Of a uniform cap the mean of 1 - cos is (1 - cos rho) / 2.
    EXPECT_NEAR(cap_radius((1 - std::cos(rho)) / 2), rho, 1e-9);
  }
}

TEST(Cap, InvalidInputNeverGivesNan) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double rho : {-1.0, 0.0, 10.0, nan, inf}) {
    for (const double c : {-2.0, 0.0, 2.0}) {
      EXPECT_TRUE(std::isfinite(cap_irradiance(c, rho)));
      EXPECT_TRUE(std::isfinite(cap_radiance(c, rho, GgxLobe(0.5))));
      EXPECT_TRUE(std::isfinite(cap_zonal(3, rho)));
    }
  }
}

}  // namespace
}  // namespace lightwell
