// Clipped caps, against closed forms.
#include "reference/cap.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "reference/quadrature.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

TEST(Cap, FullyVisibleHiddenAndHemispherical) {
  for (const double rho : {1e-3, 0.1, 0.5, 1.2, pi / 2}) {
    const double whole = cap_vector_irradiance(rho);
    for (double gamma = 0; gamma <= pi / 2 - rho; gamma += 0.05) {
      EXPECT_NEAR(cap_irradiance(rho, gamma), whole * std::cos(gamma), 1e-9 * whole);
    }
    // Just below the horizon, with a margin for rounding.
    for (double gamma = pi / 2 + rho + 1e-6; gamma <= pi; gamma += 0.1) {
      EXPECT_EQ(cap_irradiance(rho, gamma), 0);
    }
    // At the horizon exactly half of a small cap is seen: E = L int int y+ = 2/3 L rho^3 as
    // rho -> 0, up to rho^2 relative.
    if (rho < 0.01) {
      EXPECT_NEAR(cap_irradiance(rho, pi / 2) / (2.0 / 3 * std::pow(rho, 3)), 1, rho * rho);
    }
  }
  for (double gamma = 0; gamma <= pi; gamma += 0.1) {
    EXPECT_NEAR(cap_irradiance(pi / 2, gamma), pi * (1 + std::cos(gamma)) / 2, 1e-9 * pi);
  }
}

TEST(Cap, ClippedAgreesWithTheClosedForm) {
  // Lagarde & de Rousiers, "Moving Frostbite to PBR" (2014), sphere lights with horizon, times
  // pi, where the cap crosses the horizon. At gamma = 90 deg it is rho - sin rho cos rho.
  for (double rho = 0.01; rho < 1.57; rho += 0.04) {
    for (double part = -0.95; part < 1; part += 0.05) {
      const double gamma = pi / 2 + part * rho;
      const double x = 1 / std::tan(rho), y = -x / std::tan(gamma);
      const double root = std::sin(gamma) * std::sqrt(1 - y * y);
      const double s = std::sin(rho);
      const double closed = (std::cos(gamma) * std::acos(y) - x * root) * s * s + std::atan(root / x);
      // The documented accuracy.
      EXPECT_NEAR(cap_irradiance(rho, gamma), closed, 1e-9 * cap_vector_irradiance(rho));
    }
  }
}

TEST(Cap, ClippedAgreesWithALiteralSum) {
  for (const double rho : {0.3, 0.9, 1.4}) {
    for (const double gamma : {0.5, 1.2, 1.5, 1.7, 2.2}) {
      constexpr int rings = 1000, spokes = 1000;
      double sum = 0;
      for (int a = 0; a < rings; ++a) {
        const double angle = rho * (a + 0.5) / rings;
        for (int s = 0; s < spokes; ++s) {
          const double cosine = std::cos(gamma) * std::cos(angle) +
                                std::sin(gamma) * std::sin(angle) * std::cos(2 * pi * (s + 0.5) / spokes);
          sum += std::max(0.0, cosine) * std::sin(angle);
        }
      }
      sum *= rho / rings * 2 * pi / spokes;
      // Midpoints with a kink: about (1/1000)^2 of the integrand's size.
      EXPECT_NEAR(cap_irradiance(rho, gamma), sum, 1e-5);
    }
  }
}

TEST(Cap, RadiusFromTheSecondMoment) {
  for (const double rho : {1e-6, 0.01, 0.5, pi / 2}) {
    const double s = std::sin(rho / 2);
    EXPECT_NEAR(cap_radius_from_mean_versine(s * s), rho, rho * rounding);
    // The mean of 1 - cos over the cap, by quadrature; the integral's size is rho^4.
    const auto ring = [](double a) { return 2 * pi * std::sin(a) * 2 * std::pow(std::sin(a / 2), 2); };
    const double moment = integrate(ring, 0, rho, 1e-14 * std::pow(rho, 4));
    const double mean = moment / cap_solid_angle(rho);
    EXPECT_NEAR(cap_radius_from_mean_versine(mean), rho, rho * 1e-10);
  }
}

}  // namespace
}  // namespace lightwell::reference
