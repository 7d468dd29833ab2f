#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/plane_guidance.hpp>

namespace lightwell {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

PlaneCoverage coverage(int levels, std::uint8_t seen) {
  PlaneCoverage out{HemisphereGrid(levels), {}};
  out.seen.assign(out.grid.size(), seen);
  return out;
}

/// Sees or forgets the directions within an angle of `center`.
void set_around(PlaneCoverage& c, Vec3d center, double radius_rad, std::uint8_t seen) {
  for (std::size_t n = 0; n < c.grid.size(); ++n)
    if (angle_between(c.grid.direction(n), center) < radius_rad) c.seen[n] = seen;
}

Vec3d direction(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

TEST(PlaneGuidance, OfNothingIsTheNormal) {
  const PlaneGuidance g = plane_guidance(coverage(60, 0));
  EXPECT_EQ(g.seen, 0);
  EXPECT_EQ(g.progress, CaptureProgress::keep_moving);
  EXPECT_EQ(g.next, (Vec3d{0, 0, 1}));
  EXPECT_EQ(g.gap_rad, std::numbers::pi);
}

TEST(PlaneGuidance, OfAllIsEnough) {
  for (const int levels : {1, 2, 60, 120}) {
    const PlaneGuidance g = plane_guidance(coverage(levels, 1));
    EXPECT_NEAR(g.seen, 1, 1e-12);
    EXPECT_EQ(g.progress, CaptureProgress::enough);
    EXPECT_EQ(g.next, std::nullopt);
    EXPECT_EQ(g.gap_rad, 0);
  }
}

TEST(PlaneGuidance, DirectionsBelowTheCircleDoNotCount) {
  PlaneCoverage c = coverage(60, 1);
  for (std::size_t n = 0; n < c.grid.size(); ++n)
    if (c.grid.direction(n).z < std::sin(10 * kDegree)) c.seen[n] = 0;
  PlaneGuidance g = plane_guidance(c);
  EXPECT_NEAR(g.seen, 1, 1e-12);
  EXPECT_EQ(g.progress, CaptureProgress::enough);
  // They alone are nothing.
  for (std::uint8_t& s : c.seen) s = s == 0 ? 1 : 0;
  g = plane_guidance(c);
  EXPECT_EQ(g.seen, 0);
  EXPECT_EQ(g.progress, CaptureProgress::keep_moving);
  // But they are seen directions: the farthest from them is the normal, at the angle of level 54 (81 degrees).
  ASSERT_TRUE(g.next);
  EXPECT_EQ(*g.next, (Vec3d{0, 0, 1}));
  EXPECT_NEAR(g.gap_rad, 81 * kDegree, 1e-9);
}

TEST(PlaneGuidance, ShareIsThatOfTheSolidAngle) {
  PlaneCoverage c = coverage(60, 0);
  // Levels 0 to 30: theta up to 45.75 degrees, of 80.25 (level 53) that count.
  for (std::size_t n = 0; n < HemisphereGrid::first_of(31); ++n) c.seen[n] = 1;
  EXPECT_NEAR(plane_guidance(c).seen, (1 - std::cos(45.75 * kDegree)) / (1 - std::cos(80.25 * kDegree)), 1e-9);
}

TEST(PlaneGuidance, PointsIntoTheLargestHole) {
  for (const double phi : {0.0, 1.0, 1.57, 2.5, 3.2, 4.71, 6.2})
    for (const double theta : {0.0, 0.4, 0.9}) {
      PlaneCoverage c = coverage(60, 1);
      const Vec3d hole = direction(theta, phi);
      set_around(c, direction(0.7, phi + 2.5), 0.15, 0);
      set_around(c, hole, 0.3, 0);
      const PlaneGuidance g = plane_guidance(c);
      ASSERT_TRUE(g.next);
      // Nodes are 1.5 to 2.4 degrees apart: the edge of the hole and its middle are known no better.
      EXPECT_LT(angle_between(*g.next, hole), 3 * kDegree) << theta << " " << phi;
      EXPECT_NEAR(g.gap_rad, 0.3, 3 * kDegree);
      EXPECT_EQ(g.progress, CaptureProgress::keep_moving) << "the gap is 17 degrees";
    }
}

/// The distances against all pairs of nodes.
TEST(PlaneGuidance, GapIsThatOfAllPairs) {
  std::mt19937 random(1);
  for (int round = 0; round < 40; ++round) {
    const int levels = 1 + static_cast<int>(random() % 24);
    PlaneCoverage c = coverage(levels, 0);
    const std::size_t patches = 1 + random() % 6;
    for (std::size_t k = 0; k < patches; ++k)
      set_around(c, c.grid.direction(random() % c.grid.size()), round % 2 == 0 ? 1e-6 : 0.3, 1);
    double gap = 0;
    for (std::size_t n = 0; n < c.grid.size(); ++n) {
      if (c.grid.direction(n).z < std::sin(10 * kDegree) - 1e-9) continue;
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t m = 0; m < c.grid.size(); ++m)
        if (c.seen[m] != 0) nearest = std::min(nearest, angle_between(c.grid.direction(n), c.grid.direction(m)));
      gap = std::max(gap, nearest);
    }
    const PlaneGuidance g = plane_guidance(c);
    EXPECT_GE(g.gap_rad, gap - 1e-9);
    EXPECT_LE(g.gap_rad, gap + c.grid.spacing_rad()) << levels;
  }
}

TEST(PlaneGuidance, ArraysOfAnotherLengthAreNothingSeen) {
  PlaneCoverage c = coverage(60, 1);
  c.seen.pop_back();
  EXPECT_EQ(plane_guidance(c).seen, 0);
}

TEST(PlaneGuidance, DiscShowsTheCircle) {
  // tan(40 degrees); a direction at 10 degrees of elevation is on the circle.
  EXPECT_NEAR(guidance_disc_radius(), 0.8390996, 1e-6);
  const DiscPoint p = stereographic(direction(80 * kDegree, 1));
  EXPECT_NEAR(std::hypot(p.x, p.y), guidance_disc_radius(), 1e-12);
}

TEST(PlaneGuidance, ProbeDirectionIsThatFromThePlaneToTheProbe) {
  PlaneInfo info;
  EXPECT_EQ(probe_direction(info), std::nullopt);
  // The plane 0.5 m in front of the probe (-Z), facing it.
  info.T_probe_plane = Pose{{}, {0, 0, -0.5}};
  ASSERT_TRUE(probe_direction(info));
  EXPECT_NEAR(probe_direction(info)->z, 1, 1e-12);
  // Turned by 30 degrees about Y, the probe is at -X of its normal.
  info.T_probe_plane = Pose{Quat::about({0, 1, 0}, 30 * kDegree), {0, 0, -0.5}};
  EXPECT_NEAR(probe_direction(info)->x, -std::sin(30 * kDegree), 1e-12);
  info.T_probe_plane = Pose{{}, {0, 0, 0.5}};
  EXPECT_EQ(probe_direction(info), std::nullopt) << "seen from behind";
}

}  // namespace
}  // namespace lightwell
