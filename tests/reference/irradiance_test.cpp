// Brute-force irradiance and its error metric, against closed forms.
#include "reference/irradiance.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "reference/harmonics.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

TEST(Irradiance, ConstantAndDelta) {
  const Panorama flat = constant(512, 256, {1, 2, 3});
  Panorama delta = constant(64, 32, {});
  set_pixel(delta, 10, 5, {7, 0, 0});
  const V3 d = pixel_direction(10, 5, 64, 32);
  for (const V3& n : fibonacci_normals(20)) {
    // Midpoint rule: (pi/256)^2 / 24 plus the horizon's kink, of the same order: 1e-4 relative.
    EXPECT_NEAR(irradiance(flat, n)[2], 3 * pi, 3 * pi * 1e-4);
    const double expected = 7 * pixel_solid_angle(5, 64, 32) * std::max(0.0, dot(n, d));
    EXPECT_NEAR(irradiance(delta, n)[0], expected, rounding);
  }
}

TEST(Irradiance, BlockedSumIsThePlainSum) {
  const Panorama p = from_function(50, 31, smooth_scene, 1);  // not a multiple of the block size
  const std::vector<V3> normals = fibonacci_normals(21);      // not a multiple of the bundle size
  const std::vector<Rgb> found = irradiance_at(p, normals);
  for (std::size_t n = 0; n < normals.size(); ++n) {
    const Rgb plain = irradiance(p, normals[n]);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[n][c], plain[c], 10 * rounding);
  }
}

TEST(Irradiance, OfABandLimitedSceneIsItsHarmonics) {
  const Panorama p = from_function(256, 128, smooth_scene, 1);
  const std::vector<Rgb> radiance = project(p, 4);  // the scene ends at band 3
  const std::vector<V3> normals = fibonacci_normals(64);
  std::vector<Rgb> estimate;
  for (const V3& n : normals) estimate.push_back(irradiance_from_sh(radiance, n));
  // Both are midpoint sums on 128 rows: (4 pi/128)^2 / 24 = 4e-4.
  EXPECT_LT(irradiance_error(irradiance_at(p, normals), estimate).largest, 5e-4);
}

TEST(Irradiance, ErrorMetricByHand) {
  const std::vector<Rgb> truth{{3, 0, 0}, {0, 4, 0}};
  const std::vector<Rgb> estimate{{3, 0, 1}, {0, 2, 0}};
  const IrradianceError error = irradiance_error(truth, estimate);
  EXPECT_NEAR(error.rms, std::sqrt(5.0 / 25.0), rounding);
  EXPECT_NEAR(error.luminance_weighted, std::sqrt((0.0722 + 4 * 0.7152) / (9 * 0.2126 + 16 * 0.7152)), rounding);
  EXPECT_NEAR(error.largest, 2 / std::sqrt(25.0 / 6.0), rounding);
  EXPECT_EQ(irradiance_error({{0, 0, 0}}, {{0, 0, 0}}).rms, 0);
  EXPECT_TRUE(std::isinf(irradiance_error({{0, 0, 0}}, {{0, 1, 0}}).rms));
}

}  // namespace
}  // namespace lightwell::reference
