// The GGX kernel, its bands and the mean radiance under it, against closed forms.
#include "reference/ggx.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "reference/harmonics.hpp"
#include "reference/quadrature.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

TEST(Ggx, KernelIntegratesToOneAsInClosedForm) {
  for (const double r : {0.02, 0.1, 0.3, 0.5, 0.8, 0.95}) {
    // With D c = a2 c / (pi (A c + B)^2), A = (a2 - 1)/2, B = (a2 + 1)/2:
    // 2 pi int_0^1 = 2 a2 / A^2 (ln(a2/B) + B/a2 - 1).
    const double a2 = std::pow(r, 4), a = (a2 - 1) / 2, b = (a2 + 1) / 2;
    const double closed = 2 * a2 / (a * a) * (std::log(a2 / b) + b / a2 - 1);
    // The closed form cancels as a2 -> 1 (A^2 = 9e-3 at r = 0.95), the quadrature does not.
    EXPECT_NEAR(GgxKernel(r).weight_integral() / closed, 1, 1e-11);
  }
  EXPECT_NEAR(GgxKernel(1).weight_integral(), 1, rounding);  // D = 1/pi: int c / pi = 1
  EXPECT_THROW(GgxKernel(0), std::domain_error);
}

TEST(Ggx, WeightIsTheHalfVectorFormula) {
  const double alpha = 0.4 * 0.4, theta = 0.9;
  const V3 n{0, 0, 1}, l{std::sin(theta), 0, std::cos(theta)};
  const double nh = dot(n, normalised(n + l));
  const double t = nh * nh * (alpha * alpha - 1) + 1;
  const double expected = alpha * alpha / (pi * t * t) * dot(n, l);
  EXPECT_NEAR(GgxKernel(0.4).weight(1 - std::cos(theta)), expected, rounding);
  EXPECT_EQ(GgxKernel(0.4).at_cosine(-0.1), 0);
}

TEST(Ggx, LegendreCoefficients) {
  // Roughness 1 is the clamped cosine by pi.
  const std::vector<double> widest = ggx_legendre(1, 12);
  for (int l = 0; l <= 12; ++l) {
    EXPECT_NEAR(widest[static_cast<std::size_t>(l)], cosine_lobe(l) / pi, 1e-12);
  }
  for (const double r : {0.02, 0.1, 0.3, 0.6}) {
    const std::vector<double> k = ggx_legendre(r, 30);
    EXPECT_NEAR(k[0], 1, 1e-10);  // the documented accuracy
    for (std::size_t l = 1; l < k.size(); ++l) EXPECT_LT(std::abs(k[l]), 1);
    // A narrower lobe keeps more of every low band.
    EXPECT_GT(k[2], ggx_legendre(r + 0.1, 2)[2]);
    // K_1 is the mean cosine: Simpson on theta = x^3 as an unrelated rule, 200,000 steps.
    const GgxKernel kernel(r);
    constexpr int steps = 200000;
    const double end = std::cbrt(pi / 2);
    double mean = 0;
    for (int i = 0; i <= steps; ++i) {
      const double x = end * i / steps, theta = x * x * x, half = std::sin(theta / 2);
      const double f = 2 * pi * kernel.at_versine(2 * half * half) * std::cos(theta) * std::sin(theta) * 3 * x * x;
      mean += f * (i == 0 || i == steps ? 1 : i % 2 == 1 ? 4 : 2) * end / steps / 3;
    }
    EXPECT_NEAR(k[1], mean, 1e-10);
  }
}

TEST(Ggx, BandsRebuildTheKernel) {
  const GgxKernel kernel(0.7);
  const std::vector<double> k = kernel.legendre_coefficients(300);
  double sum = 0, power = 0;
  for (int l = 0; l <= 300; ++l) {
    const double value = k[static_cast<std::size_t>(l)];
    sum += (2.0 * l + 1) / (4 * pi) * value * legendre(l, 0.8);
    power += (2.0 * l + 1) / (4 * pi) * value * value;
  }
  // By the kernel's kink at the horizon, K_l decreases as l^-2.5: the tail beyond 300 is about 1e-5.
  EXPECT_NEAR(sum, kernel.at_cosine(0.8), 2e-5);
  const auto square = [&](double s) { return 2 * pi * std::pow(kernel.at_versine(s), 2); };
  EXPECT_NEAR(power, integrate(square, 0, 1, 1e-13), 1e-6);
}

TEST(Ggx, RadianceOfConstantAndOfBandOne) {
  const V3 d = normalised({0.2, 0.7, -0.4});
  const Panorama flat = constant(64, 32, {1, 2, 3});
  const Panorama tilt = from_function(
      256, 128,
      [&](const V3& l) {
        return Rgb{2 + dot(l, d), 0, 0};
      },
      1);
  for (const double r : {0.3, 0.6, 1.0}) {
    EXPECT_NEAR(radiance_ggx(flat, d, r)[2], 3, 10 * rounding);
    // 2 + K_1: lobes as wide as alpha = 0.09 rad on pixels of 0.025 rad, squared by 24: 1e-3.
    EXPECT_NEAR(radiance_ggx(tilt, d, r)[0], 2 + ggx_legendre(r, 1)[1], 1e-3);
  }
  // A lobe narrower than a pixel needs samples within the pixel; the scene is flat to 1e-3 there.
  EXPECT_NEAR(radiance_ggx(tilt, d, 0.05, 8)[0], 2 + ggx_legendre(0.05, 1)[1], 1e-3);
  EXPECT_NEAR(radiance_ggx(tilt, d, 0)[0], 3, 1e-3);
}

}  // namespace
}  // namespace lightwell::reference
