// coverage_of(): exact coverage of pixels by outlines.
#include <cmath>
#include <numeric>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/lightwell_calibrate/sheets.hpp"

namespace lightwell::calibrate {
namespace {

using Outline = std::vector<PagePoint>;

double sum(const Coverage& c) { return std::accumulate(c.share.begin(), c.share.end(), 0.0); }

float at_pixel(const Coverage& c, int x, int y) {
  x -= c.left, y -= c.top;
  return x < 0 || y < 0 || x >= c.width || y >= c.height ? 0.0F : c.at(x, y);
}

TEST(Coverage, OfARectangleIsExactInEachPixel) {
  const Coverage c = coverage_of({Outline{{1.25, 2.5}, {4.5, 2.5}, {4.5, 3.75}, {1.25, 3.75}}}, 1);
  EXPECT_NEAR(at_pixel(c, 1, 2), 0.75 * 0.5, 1e-6);
  EXPECT_NEAR(at_pixel(c, 2, 2), 0.5, 1e-6);
  EXPECT_NEAR(at_pixel(c, 4, 2), 0.25, 1e-6);
  EXPECT_NEAR(at_pixel(c, 3, 3), 0.75, 1e-6);
  EXPECT_EQ(at_pixel(c, 5, 2), 0);
  EXPECT_EQ(at_pixel(c, 0, 2), 0);
}

TEST(Coverage, OfADiagonalIsHalfAPixelOnIt) {
  const Coverage c = coverage_of({Outline{{0, 0}, {10, 10}, {0, 10}}}, 1);
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(at_pixel(c, i, i), 0.5, 1e-6);
    EXPECT_NEAR(at_pixel(c, 0, i), i == 0 ? 0.5 : 1, 1e-6);
    EXPECT_NEAR(at_pixel(c, i + 1, i), 0, 1e-6);
  }
}

TEST(Coverage, SumsToTheAreaAtAnyScalePositionAndOrientation) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-20, 20), scale(0.3, 12);
  for (int i = 0; i < 200; ++i) {
    Outline triangle = {{place(random), place(random)}, {place(random), place(random)}, {place(random), place(random)}};
    const double twice = (triangle[1].x - triangle[0].x) * (triangle[2].y - triangle[0].y) -
                         (triangle[1].y - triangle[0].y) * (triangle[2].x - triangle[0].x);
    const double s = scale(random), area = std::abs(twice) / 2 * s * s;
    EXPECT_NEAR(sum(coverage_of({triangle}, s)), area, 1e-4 * area + 1e-3);
    std::swap(triangle[0], triangle[1]);
    EXPECT_NEAR(sum(coverage_of({triangle}, s)), area, 1e-4 * area + 1e-3);
  }
}

TEST(Coverage, OfTouchingOutlinesHasNoGap) {
  // A square divided by a slanted line.
  const Coverage c =
      coverage_of({Outline{{1, 1}, {5.3, 1}, {3.1, 9}, {1, 9}}, Outline{{5.3, 1}, {9, 1}, {9, 9}, {3.1, 9}}}, 1);
  for (int y = 1; y < 9; ++y)
    for (int x = 1; x < 9; ++x) EXPECT_NEAR(at_pixel(c, x, y), 1, 1e-6);
  EXPECT_NEAR(sum(c), 64, 1e-4);
}

TEST(Coverage, OfNoOutlineIsEmpty) { EXPECT_THAT(coverage_of({}, 1).share, testing::IsEmpty()); }

}  // namespace
}  // namespace lightwell::calibrate
