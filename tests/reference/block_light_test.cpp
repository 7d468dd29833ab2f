// Radiance of blocks compared with values computed by hand, and the fit of harmonics to cells compared with known
// scenes.
#include "reference/block_light.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "reference/harmonics.hpp"
#include "reference/panorama.hpp"
#include "reference/random_scene.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

LensPixels whole_sphere(int width, int height) {
  LensPixels lens{width, height, {}, {}, {}};
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      lens.direction.push_back(pixel_direction(i, j, width, height));
      lens.solid_angle.push_back(pixel_solid_angle(j, width, height));
      lens.inverse_vignetting.push_back(1);
    }
  }
  return lens;
}

TEST(LinearValue, OfEachCurve) {
  Sensor sensor;
  sensor.black = 0.25;
  EXPECT_NEAR(linear_value(sensor, 0.5), 1.0 / 3, rounding);
  EXPECT_NEAR(linear_value(sensor, 0), -1.0 / 3, rounding) << "negative values by noise are kept";
  sensor = {};
  sensor.curve = Sensor::Curve::srgb;
  // Middle grey: code 119 of 255 is 18.4 %.
  EXPECT_NEAR(linear_value(sensor, 119.0 / 255), 0.1845, 1e-4);
  EXPECT_NEAR(linear_value(sensor, 1), 1, rounding);
  sensor.curve = Sensor::Curve::gamma;
  sensor.gamma = 2;
  EXPECT_NEAR(linear_value(sensor, 0.3), 0.09, rounding);
  sensor.curve = Sensor::Curve::table;
  sensor.table = {0, 0.1, 1};
  EXPECT_NEAR(linear_value(sensor, 0.75), 0.55, rounding);
  EXPECT_NEAR(linear_value(sensor, 1), 1, rounding);
}

TEST(BlockLight, OfFourPixelsByHand) {
  LensPixels lens{2, 2, std::vector<V3>(4, V3{0, 0, 1}), {1, 2, 3, 0}, {1, 2, 1, 1}};
  CodePicture picture;
  picture.exposure = 0.5;
  // The last pixel has no solid angle: it counts neither for the peak nor as saturated.
  picture.codes = {{51, 51, 51, 51}, {102, 51, 153, 102}, {255, 0, 0, 0}, {255, 255, 255, 255}};
  Sensor sensor;
  sensor.read_noise = 0.1;
  const std::vector<PixelLight> light = light_of(lens, sensor, {&picture, 1});
  const LensLight all = block_light(lens, light, 2);
  ASSERT_EQ(all.blocks.size(), 1U);
  const BlockLight& b = all.blocks[0];
  // 51 is a fifth: radiance 0.4; 102 over a vignetting of one half: 1.6, both greens together the same; red alone: 2.
  EXPECT_NEAR(b.sum[0], 1 * 0.4 + 2 * 1.6 + 3 * 2, rounding * 10);
  EXPECT_NEAR(b.sum[1], 1 * 0.4 + 2 * 1.6, rounding * 10);
  EXPECT_NEAR(b.peak, 1.6, rounding);
  const double l = 0.4 + 2 * 1.6 + 3 * 2 * 0.2126;
  EXPECT_NEAR(b.offset.x, 2 * 1.6 / l - 2.0 / 6, rounding);
  EXPECT_NEAR(b.offset.y, 3 * 2 * 0.2126 / l - 3.0 / 6, rounding);
  EXPECT_NEAR(all.clipped_sr, 3, rounding);
  const double variance = (0.01 + 1 / (255.0 * 255 * 12)) * 4;
  EXPECT_NEAR(all.noise, (1 + 4 * 4 + 9) * variance, rounding);
  EXPECT_EQ(block_light(lens, light, 1).blocks.size(), 4U);
}

TEST(BlockLight, OfABracketIsWeightedByInverseVariance) {
  LensPixels lens{3, 1, std::vector<V3>(3, V3{0, 0, 1}), {1, 1, 1}, {1, 1, 1}};
  Sensor sensor;
  sensor.read_noise = 0.01;
  const auto grey = [](unsigned c) { return Codes{c, c, c, c}; };
  const std::vector<CodePicture> bracket = {{256, 1, {grey(51), grey(255), grey(255)}},
                                            {256, 0.1, {grey(6), grey(51), grey(255)}}};
  const std::vector<PixelLight> light = light_of(lens, sensor, bracket);
  // With equal noise of x, the longer exposure has a hundred times the weight.
  EXPECT_NEAR(light[0].radiance[1], (100 * 0.2 + 60.0 / 255) / 101, rounding);
  EXPECT_NEAR(light[1].radiance[1], 2, 1e-6) << "the longer exposure is saturated";
  EXPECT_FALSE(light[1].clipped);
  EXPECT_NEAR(light[2].radiance[1], 10, rounding) << "saturated in both: the higher bound";
  EXPECT_TRUE(light[2].clipped);
}

TEST(CellCoefficients, ReproduceBandLimitedScenes) {
  const RandomScene scene(1, 0);
  const LensPixels lens = whole_sphere(64, 32);
  std::vector<PixelLight> pixels;
  for (const V3& d : lens.direction) pixels.push_back({evaluate(scene.harmonics, d), 0, false});
  const LensLight light = block_light(lens, pixels, 4);
  std::vector<double> solid_angle;
  std::vector<Rgb> sums;
  for (const BlockLight& b : light.blocks) {
    solid_angle.push_back(b.solid_angle);
    sums.push_back(b.sum);
  }
  const std::vector<double> means = block_harmonics(lens, 4, 8);
  const std::vector<Rgb> fit = cell_coefficients(means, 8, solid_angle, sums, 6);
  // With blocks of 22 degrees, the plain sums have errors of some percent, the fit has none.
  double plain_off = 0;
  const std::vector<Rgb> plain = cell_coefficients(means, 8, solid_angle, sums, -1);
  for (std::size_t k = 0; k < 49; ++k) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(fit[k][c], scene.harmonics[k][c], rounding * 10) << k;
      plain_off = std::max(plain_off, std::abs(plain[k][c] - scene.harmonics[k][c]));
    }
  }
  EXPECT_GT(plain_off, 1e-3);
  for (std::size_t k = 49; k < 81; ++k) EXPECT_EQ(fit[k], plain[k]) << "bands above the fit are plain sums";
}

TEST(RandomScene, IsNonNegativeAndReproducible) {
  const RandomScene a(3), b(3), c(4);
  double differs = 0;
  for (const V3& d : fibonacci_normals(500)) {
    const Rgb l = a.radiance(d);
    EXPECT_EQ(l, b.radiance(d));
    for (const double v : l) EXPECT_GE(v, a.darkest);
    differs += std::abs(l[0] - c.radiance(d)[0]);
  }
  EXPECT_GT(differs, 10);
}

}  // namespace
}  // namespace lightwell::reference
