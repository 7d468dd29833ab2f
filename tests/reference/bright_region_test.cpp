// The definition of bright regions, compared with closed forms.
#include "reference/bright_region.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "reference/cap.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

TEST(BrightRegion, DiscLampAnywhere) {
  // The centre, the seam, both poles' neighbourhoods.
  for (const V3& axis :
       {V3{0, 0, -1}, normalised({0.01, 0.2, 1}), normalised({0.05, 1, 0.02}), normalised({0.1, -1, -0.05})}) {
    const double rho = 0.15;
    const Panorama lamp = disc_lamp(256, 128, axis, rho, {10, 20, 30});
    const BrightRegion region = bright_region(lamp).value();
    // Half-covered rim pixels may be inside or outside (pixels of 0.025 rad, 38 on the rim): this moves
    // the centre by less than a tenth of a pixel and the radii by less than a fifth.
    EXPECT_LT(angle_deg(region.direction, axis), 0.14);
    EXPECT_NEAR(region.angular_radius_rad, rho, 0.005);
    EXPECT_NEAR(region.solid_angle_radius_rad, rho, 0.005);
    EXPECT_NEAR(region.vector_irradiance[1] / (20 * cap_vector_irradiance(rho)), 1, 0.05);
    // Cosines within the cap: the two integrals differ by cos^2(rho/2) = 0.9944.
    EXPECT_NEAR(region.vector_irradiance[1] / region.radiance_integral[1], 0.9944, 1e-3);
    // Exact but for the rim: 4 pi / (2 pi (1 - cos rho)).
    EXPECT_NEAR(region.peak_to_mean * cap_solid_angle(rho) / (4 * pi), 1, 0.01);
  }
}

TEST(BrightRegion, ConnectionBySeamPoleAndHalf) {
  Panorama p = constant(8, 6, {});
  const auto light = [&](int i, int j, double value) { set_pixel(p, i, j, {value, value, value}); };
  light(0, 2, 10);
  light(7, 3, 5);    // diagonal over the seam, exactly half
  light(1, 2, 4.9);  // below half
  light(3, 2, 9);    // apart
  EXPECT_EQ(bright_region(p).value().pixels, (std::vector<std::size_t>{2 * 8 + 0, 3 * 8 + 7}));

  p = constant(8, 6, {});
  light(1, 0, 10);
  light(5, 0, 8);  // across the pole
  light(6, 1, 8);  // adjacent to that
  light(3, 0, 8);  // 90 degrees away: not connected
  EXPECT_EQ(bright_region(p).value().pixels, (std::vector<std::size_t>{1, 5, 8 + 6}));

  p = constant(7, 4, {});
  light(1, 3, 10);
  light(4, 3, 8);  // odd width: columns 1 + 3 and 1 + 4 touch the opposite meridian
  light(5, 3, 8);
  EXPECT_EQ(bright_region(p).value().pixels.size(), 3u);
}

TEST(BrightRegion, SeveralAndNone) {
  Panorama p = sum(disc_lamp(64, 32, {1, 0, 0}, 0.2, {50, 50, 50}), disc_lamp(64, 32, {0, 1, 0}, 0.2, {20, 20, 20}));
  set_pixel(p, 3, 20, {-100, std::nan(""), 0});
  const std::vector<BrightRegion> found = bright_regions(p, 2);
  ASSERT_EQ(found.size(), 2u);
  // Both are symmetric about their axes on this grid but for samples of 1/32 pixel at the rim.
  EXPECT_LT(angle_deg(found[0].direction, {1, 0, 0}), 0.2);
  EXPECT_LT(angle_deg(found[1].direction, {0, 1, 0}), 0.2);
  EXPECT_FALSE(bright_region(constant(4, 2, {-1, 0, 0})).has_value());
  // A constant image has the direction of its first pixel.
  const V3 first = bright_region(constant(8, 4, {1, 1, 1})).value().direction;
  EXPECT_LT(distance(first, pixel_direction(0, 0, 8, 4)), rounding);
}

}  // namespace
}  // namespace lightwell::reference
