// Recovery of clipped lights from one reading of irradiance: the solver alone, compared with analytic sums.
#include "estimate/common/clipped_energy.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/query.hpp>

namespace lightwell {
namespace {

/// A constant sky of radiance 1 and two lamps; the first is clipped to `share` of its energy.
Descriptor scene(float share = 1) {
  Descriptor d;
  d.units = Units::absolute;
  d.radiance.band = 0;
  d.radiance.c[0] = {3.5449077F, 3.5449077F, 3.5449077F};
  d.lights.push_back({{0, 1, 0}, Irradiance{100, 90, 80} * share, 0.01F, {}, 7});
  d.lights.push_back({{1, 0, 0}, {20, 20, 20}, 0.01F, {}, 8});
  return d;
}

double reading(const Descriptor& truth, Vec3f normal) { return irradiance_at(truth, normal).luminance(); }

std::vector<ClippedLight> clipped(const Descriptor& d, std::initializer_list<std::uint32_t> tracks) {
  std::vector<ClippedLight> out;
  for (const Light& l : d.lights)
    for (const std::uint32_t t : tracks)
      if (l.track == t) out.push_back({t, l.irradiance});
  return out;
}

const float kDiagonal = std::sqrt(0.5F);

TEST(ClippedEnergy, AReadingRecoversTheClippedEnergy) {
  for (const Vec3f normal : {Vec3f{0, 1, 0}, Vec3f{kDiagonal, kDiagonal, 0}, Vec3f{0, 0.6F, 0.8F}}) {
    for (const float share : {0.9F, 0.1F, 1e-3F}) {
      Descriptor d = scene(share);
      const auto lights = clipped(d, {7});
      Recovery r;
      ASSERT_EQ(recover(d, lights, {normal, reading(scene(), normal)}, r), RecoveryFault::none);
      const RecoveryResult applied = apply(r, lights, d);
      EXPECT_TRUE(applied.all);
      EXPECT_NEAR(d.lights[0].irradiance.r, 100, 0.1);
      EXPECT_NEAR(d.lights[0].irradiance.b, 80, 0.1);
      EXPECT_EQ(d.lights[1].irradiance.r, 20) << "unclipped lights are unchanged";
      // 5 % of the reading, converted to the light's irradiance at normal incidence.
      const double expected = 0.05 * reading(scene(), normal) / normal.y;
      EXPECT_NEAR(applied.uncertainty, expected, 0.01 * expected);
    }
  }
}

TEST(ClippedEnergy, AnotherReadingReplacesTheFirst) {
  Descriptor d = scene(0.2F);
  const auto lights = clipped(d, {7});
  Recovery r;
  // The first reading is too large by a factor of two, and the descriptor contains its result.
  ASSERT_EQ(recover(d, lights, {{0, 1, 0}, 2 * reading(scene(), {0, 1, 0})}, r), RecoveryFault::none);
  apply(r, lights, d);
  EXPECT_GT(d.lights[0].irradiance.r, 150);
  ASSERT_EQ(recover(d, lights, {{0, 1, 0}, reading(scene(), {0, 1, 0})}, r), RecoveryFault::none);
  Descriptor next = scene(0.2F);
  apply(r, lights, next);
  EXPECT_NEAR(next.lights[0].irradiance.r, 100, 0.1);
}

TEST(ClippedEnergy, TwoClippedLightsGetTheSameFactor) {
  Descriptor d = scene();
  d.lights[0].irradiance = d.lights[0].irradiance * 0.5F;
  d.lights[1].irradiance = d.lights[1].irradiance * 0.5F;
  const auto lights = clipped(d, {7, 8});
  Recovery r;
  const Vec3f normal{kDiagonal, kDiagonal, 0};
  ASSERT_EQ(recover(d, lights, {normal, reading(scene(), normal)}, r), RecoveryFault::none);
  EXPECT_TRUE(apply(r, lights, d).all);
  EXPECT_NEAR(d.lights[0].irradiance.g, 90, 0.1);
  EXPECT_NEAR(d.lights[1].irradiance.g, 20, 0.1);
}

TEST(ClippedEnergy, UselessReadingsAreRefused) {
  const Descriptor d = scene(0.2F);
  const auto lights = clipped(d, {7});
  Recovery r;
  r.count = 99;
  const float nan = std::nanf(""), infinite = std::numeric_limits<float>::infinity();
  for (const double e : {0.0, -5.0, static_cast<double>(nan), static_cast<double>(infinite)})
    EXPECT_EQ(recover(d, lights, {{0, 1, 0}, e}, r), RecoveryFault::no_reading) << e;
  for (const Vec3f n : {Vec3f{0, 0, 0}, Vec3f{nan, 0, 0}, Vec3f{0, 2, 0}, Vec3f{infinite, 0, 0}})
    EXPECT_EQ(recover(d, lights, {n, 100}, r), RecoveryFault::no_reading);
  EXPECT_EQ(recover(d, lights, {{0, -1, 0}, 100}, r), RecoveryFault::faces_away);
  EXPECT_EQ(recover(d, lights, {{1, 0, 0}, 100}, r), RecoveryFault::faces_away) << "grazing";
  EXPECT_EQ(recover(d, {}, {{0, 1, 0}, 100}, r), RecoveryFault::nothing_clipped);
  const std::vector<ClippedLight> gone{{55, {1, 1, 1}}};
  EXPECT_EQ(recover(d, gone, {{0, 1, 0}, 100}, r), RecoveryFault::nothing_clipped);
  const double seen = reading(d, {0, 1, 0});
  EXPECT_EQ(recover(d, lights, {{0, 1, 0}, 0.9 * seen}, r), RecoveryFault::below_observed);
  EXPECT_EQ(r.count, 99U) << "a refusal must not change the output";
  for (const RecoveryFault f : {RecoveryFault::no_reading, RecoveryFault::nothing_clipped, RecoveryFault::faces_away,
                                RecoveryFault::below_observed}) {
    EXPECT_FALSE(status_of(f).ok());
    EXPECT_FALSE(status_of(f).message().empty());
  }
}

TEST(ClippedEnergy, AReadingWithinItsErrorChangesNothing) {
  Descriptor d = scene(0.2F);
  const auto lights = clipped(d, {7});
  Recovery r;
  ASSERT_EQ(recover(d, lights, {{0, 1, 0}, 0.97 * reading(d, {0, 1, 0})}, r), RecoveryFault::none);
  EXPECT_TRUE(apply(r, lights, d).all);
  EXPECT_FLOAT_EQ(d.lights[0].irradiance.r, 20);
}

TEST(ClippedEnergy, IsKeptWhileTheLightsStayClipped) {
  Descriptor d = scene(0.2F);
  const auto lights = clipped(d, {7});
  Recovery r;
  ASSERT_EQ(recover(d, lights, {{0, 1, 0}, reading(scene(), {0, 1, 0})}, r), RecoveryFault::none);
  Descriptor brighter = scene(1.5F);
  EXPECT_TRUE(apply(r, clipped(brighter, {7}), brighter).all);
  EXPECT_FLOAT_EQ(brighter.lights[0].irradiance.r, 150) << "a larger lower bound replaces the recovered value";
  Descriptor both = scene(0.2F);
  EXPECT_FALSE(apply(r, clipped(both, {7, 8}), both).all) << "the second light is not recovered";
  EXPECT_NEAR(both.lights[0].irradiance.r, 100, 0.1);
  Descriptor open = scene(0.2F);
  EXPECT_FALSE(apply(r, {}, open).all);
  EXPECT_FLOAT_EQ(open.lights[0].irradiance.r, 20) << "an unclipped light keeps its measured value";
  Descriptor again = scene(0.2F);
  EXPECT_FALSE(apply(r, clipped(again, {7}), again).all) << "the recovery was removed";
}

}  // namespace
}  // namespace lightwell
