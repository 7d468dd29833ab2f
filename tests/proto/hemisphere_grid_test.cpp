// The discretisation of the hemisphere: its counts, its directions, and interpolation between them.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/hemisphere_grid.hpp>

namespace lightwell {
namespace {

constexpr double kPi = std::numbers::pi;

Vec3d upper_direction(int i, int count) { return fibonacci_direction(i, 2 * count); }

TEST(HemisphereGrid, HasThePapersCounts) {
  EXPECT_EQ(HemisphereGrid(60).size(), 7321U);  // Section 6.3 of the paper.
  EXPECT_EQ(HemisphereGrid(16).size(), 545U);
  EXPECT_EQ(HemisphereGrid(1).size(), 5U);
  EXPECT_EQ(HemisphereGrid(0).levels(), 1);
}

TEST(HemisphereGrid, DirectionsAreThoseOfTheLevels) {
  const HemisphereGrid grid(3);
  EXPECT_EQ(grid.direction(0), (Vec3d{0, 0, 1}));
  // Level 1 at 30 degrees: four nodes, the first at +X.
  EXPECT_NEAR(grid.direction(1).x, 0.5, 1e-15);
  EXPECT_NEAR(grid.direction(2).y, 0.5, 1e-15);
  // Level 3 is the horizon: 12 nodes, 30 degrees apart.
  EXPECT_EQ(grid.direction(13).z, 0);
  EXPECT_NEAR(grid.direction(14).y, 0.5, 1e-15);
  for (std::size_t node = 0; node < grid.size(); ++node) EXPECT_NEAR(length(grid.direction(node)), 1, 1e-15);
}

TEST(HemisphereGrid, SolidAnglesSumToTheHemisphere) {
  for (const int levels : {1, 2, 20, 60, 512}) {
    const HemisphereGrid grid(levels);
    double sum = 0, least = 9, most = 0;
    for (std::size_t node = 0; node < grid.size(); ++node) {
      sum += grid.solid_angle(node);
      if (grid.level_of(node) == 0 || grid.level_of(node) == levels) continue;
      least = std::min(least, grid.solid_angle(node)), most = std::max(most, grid.solid_angle(node));
    }
    // Half a million terms of rounding at 512 levels.
    EXPECT_NEAR(sum, 2 * kPi, 1e-11) << levels;
    // Evenly spread: sin(theta) / theta is 1 at the pole and 2 / pi at the horizon.
    if (levels > 1) {
      EXPECT_LT(most / least, kPi / 2 + 1e-9) << levels;
    }
  }
}

TEST(HemisphereGrid, EveryNodeIsItsOwnNearest) {
  for (const int levels : {1, 2, 7, 60}) {
    const HemisphereGrid grid(levels);
    for (std::size_t node = 0; node < grid.size(); ++node)
      EXPECT_EQ(grid.nearest(vec_cast<float>(grid.direction(node))), node) << levels;
  }
}

TEST(HemisphereGrid, InterpolationReproducesThetaAndStaysWithinATriangle) {
  const HemisphereGrid grid(60);
  for (int i = 0; i < 20'000; ++i) {
    const Vec3d d = upper_direction(i, 20'000);
    const auto at = grid.interpolate(vec_cast<float>(d));
    double sum = 0, theta = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GE(at.weight[k], -1e-5F);
      sum += double{at.weight[k]};
      theta += double{at.weight[k]} * grid.level_of(at.node[k]) * grid.spacing_rad();
      // The longest side of a lattice triangle at the pole: one spacing in theta, pi / 2 of it in azimuth.
      if (at.weight[k] > 1e-5F) {
        EXPECT_LT(angle_between(d, grid.direction(at.node[k])), 1.87 * grid.spacing_rad());
      }
    }
    EXPECT_NEAR(sum, 1, 1e-6);
    // Float azimuths and angles: 60 levels times a few 1e-7.
    EXPECT_NEAR(theta, std::acos(d.z), 2e-5);
  }
}

// The paper interpolates between the three nodes that are nearest on the sphere.
TEST(HemisphereGrid, TheNearestOfTheTriangleIsTheNearestOfAll) {
  const HemisphereGrid grid(60);
  int nearest = 0;
  constexpr int kCount = 500;
  for (int i = 0; i < kCount; ++i) {
    const Vec3d d = upper_direction(i, kCount);
    const double to_triangle = angle_between(d, grid.direction(grid.nearest(vec_cast<float>(d))));
    double least = 9;
    for (std::size_t node = 0; node < grid.size(); ++node)
      least = std::min(least, angle_between(d, grid.direction(node)));
    nearest += to_triangle < least + 1e-6 ? 1 : 0;
    EXPECT_LT(to_triangle, least + 0.35 * grid.spacing_rad());
  }
  EXPECT_GE(nearest, 0.85 * kCount);
}

TEST(HemisphereGrid, IsContinuousOverQuartersPoleAndHorizon) {
  const HemisphereGrid grid(20);
  std::vector<double> value(grid.size());
  for (std::size_t node = 0; node < grid.size(); ++node) {
    const Vec3d d = grid.direction(node);
    value[node] = d.x + 2 * d.y * d.z;
  }
  const auto at = [&](Vec3d d) {
    const auto where = grid.interpolate(vec_cast<float>(d));
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += double{where.weight[k]} * value[where.node[k]];
    return sum;
  };
  for (int turn = 0; turn < 4; ++turn)
    for (double theta = 0.001; theta < kPi / 2; theta += 0.01) {
      const double phi = turn * kPi / 2;
      const auto direction = [&](double t, double p) {
        return Vec3d{std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)};
      };
      EXPECT_NEAR(at(direction(theta, phi - 1e-5)), at(direction(theta, phi + 1e-5)), 1e-4);
      // Linear interpolation of a function with second derivatives of at most 4 (h² / 8 times that), and the sagitta of
      // an arc between two nodes of a level: 0.31 spacings on level 1, less on those farther out.
      const Vec3d d = direction(theta, phi + 0.3);
      const double level = std::max(1.0, std::floor(theta / grid.spacing_rad()));
      EXPECT_NEAR(at(d), d.x + 2 * d.y * d.z, 4e-3 + 2.3 * 0.31 * grid.spacing_rad() / level) << theta;
    }
}

TEST(HemisphereGrid, HasAnAnswerForEveryInput) {
  const HemisphereGrid grid(60);
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  for (const Vec3f d : {Vec3f{0, 0, 0}, Vec3f{nan, 0, 1}, Vec3f{0, nan, 1}, Vec3f{1, 0, nan}, Vec3f{0, 0, infinite},
                        Vec3f{1, 1, -1}, Vec3f{-1, -1e-30F, 0}, Vec3f{1, -1e-9F, 1}, Vec3f{infinite, 0, 0}}) {
    const auto at = grid.interpolate(d);
    float sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_LT(at.node[k], grid.size());
      sum += at.weight[k];
    }
    EXPECT_NEAR(sum, 1, 1e-5);
  }
  // Below the horizon: the horizon.
  EXPECT_EQ(grid.nearest({1, 0, -1}), HemisphereGrid::first_of(60));
}

TEST(Stereographic, IsTheTangentOfHalfTheAngle) {
  EXPECT_NEAR(stereographic({1, 0, 0}).x, 1, 1e-15);
  EXPECT_NEAR(stereographic({0, 0, 1}).x, 0, 1e-15);
  for (int i = 0; i < 100; ++i) {
    const Vec3d d = upper_direction(i, 100);
    const DiscPoint p = stereographic(d);
    EXPECT_NEAR(std::hypot(p.x, p.y), std::tan(std::acos(d.z) / 2), 1e-12);
    EXPECT_NEAR(angle_between(from_stereographic(p), d), 0, 1e-7);
  }
}

}  // namespace
}  // namespace lightwell
