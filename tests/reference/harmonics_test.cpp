// Spherical harmonics and the cosine lobe, against closed forms.
#include "reference/harmonics.hpp"

#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

#include "reference/quadrature.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

TEST(Harmonics, PolynomialFormsOfTheReadme) {
  for (const V3& d : fibonacci_normals(50)) {
    const std::vector<double> y = harmonics(d, 2);
    const double expected[] = {0.282095,
                               0.488603 * d.y,
                               0.488603 * d.z,
                               0.488603 * d.x,
                               1.092548 * d.x * d.y,
                               1.092548 * d.y * d.z,
                               0.315392 * (3 * d.z * d.z - 1),
                               1.092548 * d.x * d.z,
                               0.546274 * (d.x * d.x - d.y * d.y)};
    // The constants are given to six decimals.
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(y[k], expected[k], 1.1e-6);
  }
}

TEST(Harmonics, OrthonormalByQuadrature) {
  // Gauss-Legendre in z times equal steps in phi: exact for the degree 2 * 12 of the products.
  constexpr int band = 12;
  const std::size_t count = (band + 1) * (band + 1);
  std::vector<double> gram(count * count);
  const GaussLegendre rule = gauss_legendre(16);
  for (std::size_t i = 0; i < 16; ++i) {
    const double ring = std::sqrt(1 - rule.nodes[i] * rule.nodes[i]);
    for (int k = 0; k < 32; ++k) {
      const double phi = 2 * pi * k / 32;
      const std::vector<double> y = harmonics({ring * std::cos(phi), ring * std::sin(phi), rule.nodes[i]}, band);
      for (std::size_t a = 0; a < count; ++a) {
        for (std::size_t b = 0; b < count; ++b) {
          gram[a * count + b] += rule.weights[i] * 2 * pi / 32 * y[a] * y[b];
        }
      }
    }
  }
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = 0; b < count; ++b) {
      EXPECT_NEAR(gram[a * count + b], a == b ? 1 : 0, rounding * 10);
    }
  }
}

TEST(Harmonics, HighBandsAgreeWithTheStandardLibrary) {
  // std::sph_legendre carries the Condon-Shortley sign (-1)^m; ours must not.
  const double theta = 0.7, phi = 1.9;
  const V3 d{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
  const std::vector<double> y = harmonics(d, 60);
  for (int l = 0; l <= 60; ++l) {
    for (int m = -l; m <= l; ++m) {
      const int a = std::abs(m);
      const double zonal = std::sph_legendre(static_cast<unsigned>(l), static_cast<unsigned>(a), theta);
      const double azimuth = m == 0 ? 1 : std::sqrt(2.0) * (m > 0 ? std::cos(a * phi) : std::sin(a * phi));
      // Recursions of 60 steps on values up to 10: 1e-12.
      EXPECT_NEAR(y[static_cast<std::size_t>(harmonic_index(l, m))], (a % 2 == 1 ? -1 : 1) * zonal * azimuth, 1e-12);
    }
  }
}

TEST(Harmonics, ProjectionOfConstantDeltaAndHarmonic) {
  const std::vector<Rgb> flat = project(constant(128, 64, {1, 2, 4}), 4);
  EXPECT_NEAR(flat[0][2], 4 * std::sqrt(4 * pi), 4 * std::sqrt(4 * pi) * rounding);
  // Midpoints in latitude: about (l pi/64)^2 / 24 times 4 sqrt(4 pi), l = 4.
  for (std::size_t k = 1; k < flat.size(); ++k) EXPECT_NEAR(flat[k][2], 0, 0.025);

  Panorama delta = constant(128, 64, {});
  set_pixel(delta, 90, 20, {0, 3, 0});
  const std::vector<double> y = harmonics(pixel_direction(90, 20, 128, 64), 6);
  const std::vector<Rgb> point = project(delta, 6);
  for (std::size_t k = 0; k < y.size(); ++k) {
    EXPECT_NEAR(point[k][1], 3 * pixel_solid_angle(20, 128, 64) * y[k], rounding);
  }

  const std::size_t one = static_cast<std::size_t>(harmonic_index(3, -2));
  const Panorama wave = from_function(
      256, 128,
      [&](const V3& d) {
        return Rgb{harmonics(d, 3)[one], 0, 0};
      },
      1);
  const std::vector<Rgb> found = project(wave, 4);
  // (2 l pi/128)^2 / 24 of midpoint error for the product of two bands l <= 4: 2e-3.
  for (std::size_t k = 0; k < found.size(); ++k) EXPECT_NEAR(found[k][0], k == one ? 1 : 0, 2e-3);
  EXPECT_NEAR(evaluate(found, {0.6, 0, 0.8})[0], harmonics({0.6, 0, 0.8}, 3)[one], 1e-2);
}

TEST(Harmonics, CosineLobe) {
  const double house[] = {pi, 2 * pi / 3, pi / 4, 0, -pi / 24, 0, pi / 64};
  for (int l = 0; l <= 6; ++l) EXPECT_NEAR(cosine_lobe(l), house[l], rounding);
  for (int l = 0; l <= 40; ++l) {
    EXPECT_NEAR(cosine_lobe(l), cosine_lobe_by_quadrature(l), rounding);
  }
}

}  // namespace
}  // namespace lightwell::reference
