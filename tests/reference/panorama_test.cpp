// The equirectangular mapping, analytic scenes and their rotation, against closed forms.
#include "reference/panorama.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "reference/cap.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

TEST(Panorama, MappingByHand) {
  // 4x3 pixels: row 1 is the horizon; u = 1/2 at x = 1.5, 3/4 at 2.5, 1 at 3.5; v = 0 at -0.5.
  EXPECT_LT(distance(pixel_direction(1.5, 1, 4, 3), {0, 0, -1}), rounding);
  EXPECT_LT(distance(pixel_direction(2.5, 1, 4, 3), {1, 0, 0}), rounding);
  EXPECT_LT(distance(pixel_direction(3.5, 1, 4, 3), {0, 0, 1}), rounding);
  EXPECT_LT(distance(pixel_direction(1.5, -0.5, 4, 3), {0, 1, 0}), rounding);
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 4; ++i) {
      const V2 back = direction_to_pixel(pixel_direction(i, j, 4, 3), 4, 3);
      EXPECT_NEAR(back.x, i, rounding);
      EXPECT_NEAR(back.y, j, rounding);
    }
  }
}

TEST(Panorama, SolidAnglesFillTheSphere) {
  double sum = 0;
  for (int j = 0; j < 512; ++j) {
    const double literal = 2 * pi / 1024 * (std::sin(pi * (0.5 - j / 512.0)) - std::sin(pi * (0.5 - (j + 1) / 512.0)));
    // The difference of two sines near 1 keeps an absolute 2e-16 * 2 pi / 1024.
    EXPECT_NEAR(pixel_solid_angle(j, 1024, 512), literal, 1e-17);
    sum += 1024 * pixel_solid_angle(j, 1024, 512);
  }
  EXPECT_NEAR(sum, 4 * pi, 4 * pi * rounding);
}

TEST(Panorama, CleaningAndMean) {
  const double inf = std::numeric_limits<double>::infinity();
  const Panorama p{2, 1, {std::nan(""), -1, 2, inf, 5, -inf}};
  EXPECT_EQ(cleaned(p).rgb, (std::vector<double>{0, 0, 2, 5, 5, 0}));
  EXPECT_EQ(cleaned(Panorama{1, 1, {inf, 0, 0}}).rgb, (std::vector<double>{0, 0, 0}));
  EXPECT_NEAR(mean_radiance(constant(17, 9, {1, 2, 3}))[2], 3, 3 * rounding);
  // The mean of max(0, y) is 1/4; midpoints of 4 x 64 rows leave (pi/256)^2 / 24.
  const Panorama sky = from_function(
      32, 64,
      [](const V3& d) {
        return Rgb{std::max(0.0, d.y), 0, 0};
      },
      4);
  EXPECT_NEAR(mean_radiance(sky)[0], 0.25, 1e-5);
}

TEST(Panorama, DiscLampHasThePowerOfItsCap) {
  for (const V3& axis : {V3{0, 1, 0}, V3{0, 0, 1}, normalised({1, -2, 0.5})}) {
    const double rho = 0.2;
    const Panorama lamp = disc_lamp(128, 64, axis, rho, {1, 1, 1});
    // Cells of pi/64/32 rad: their ramp squared by rho^2 is 6e-5, and the rim's slant in them
    // leaves about as much.
    EXPECT_NEAR(4 * pi * mean_radiance(lamp)[0] / cap_solid_angle(rho), 1, 2e-4);
  }
}

TEST(Panorama, TurningASmoothSceneAndBack) {
  const Panorama p = from_function(256, 128, smooth_scene, 1);
  for (const V3& axis : {V3{1, 0, 0}, V3{0, 1, 0}, V3{0.3, -1, 2}}) {
    const M3 turn = rotation_about(axis, pi / 2);
    const Panorama found = turned(p, turn, 96, 48, 1);
    const M3 back = transposed(turn);
    for (int j = 0; j < 48; ++j) {
      for (int i = 0; i < 96; ++i) {
        const Rgb truth = smooth_scene(rotated(back, pixel_direction(i, j, 96, 48)));
        // Bilinear: h^2/8 |f''| on both axes, h = 2 pi/256, |f''| about 2 here: 3e-4. At a
        // pole itself longitude is the fast axis but the mirrored row keeps the order.
        const Rgb value = pixel(found, i, j);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(value[c], truth[c], 4e-4);
      }
    }
  }
}

TEST(Panorama, SamplingAcrossSeamAndPole) {
  const Panorama p = from_function(64, 33, smooth_scene, 1);
  // Continuous where a column or row index jumps: a step of 1e-9 changes the value by no more
  // than the slope (below 10 per rad).
  const Rgb left = sample(p, {-1e-9, 0.1, 1}), right = sample(p, {1e-9, 0.1, 1});
  const Rgb before = sample(p, {1e-9, 1, 0}), behind = sample(p, {-1e-9, 1, 0});
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(left[c], right[c], 2e-8);
    EXPECT_NEAR(before[c], behind[c], 2e-8);
  }
}

}  // namespace
}  // namespace lightwell::reference
