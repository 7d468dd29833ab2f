// Queries at a time: interpolation, extrapolation, and the limits of the stored history.
#include "core/history.hpp"

#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/geometry.hpp>

#include "host_sdk/scenes.hpp"

namespace lightwell::core {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr Duration kMaxAge{250 * kMs};
constexpr Duration kAhead{50 * kMs};

std::shared_ptr<const History> with(std::shared_ptr<const History> history, Descriptor descriptor, std::int64_t host_ns,
                                    std::size_t capacity = 64) {
  Sample sample = sample_of(std::move(descriptor));
  sample.mid_exposure = {host_ns};
  return appended(history.get(), std::make_shared<const Sample>(std::move(sample)), capacity);
}

/// Sequence number n at n * 100 ms with radiance n.
std::shared_ptr<const History> steady(std::uint64_t first, std::uint64_t last, std::size_t capacity = 64) {
  std::shared_ptr<const History> history;
  for (std::uint64_t n = first; n <= last; ++n) {
    const auto t = static_cast<std::int64_t>(n) * 100 * kMs;
    history = with(history, test::numbered(n, t), t, capacity);
  }
  return history;
}

TEST(History, IsEmptyBeforeTheFirstDescriptor) {
  EXPECT_EQ(newest_lighting(nullptr, {0}, kMaxAge).validity(), Validity::none);
  EXPECT_EQ(lighting_at(nullptr, {0}, kMaxAge, kAhead).validity(), Validity::none);
}

TEST(History, NewestReportsItsAge) {
  const auto history = steady(1, 3);
  const Lighting lighting = newest_lighting(history.get(), {340 * kMs}, kMaxAge);
  EXPECT_EQ(lighting.descriptor().sequence, 3U);
  EXPECT_EQ(lighting.age().ns, 40 * kMs);
  EXPECT_EQ(lighting.validity(), Validity::valid);
  EXPECT_EQ(newest_lighting(history.get(), {551 * kMs}, kMaxAge).validity(), Validity::stale);
  // A clock error must not give a negative age.
  EXPECT_EQ(newest_lighting(history.get(), {299 * kMs}, kMaxAge).age().ns, 0);
}

TEST(History, MidpointIsTheMean) {
  const Lighting lighting = lighting_at(steady(1, 3).get(), {250 * kMs}, kMaxAge, kAhead);
  EXPECT_EQ(lighting.validity(), Validity::valid);
  EXPECT_EQ(lighting.mid_exposure().ns, 250 * kMs);
  EXPECT_EQ(lighting.descriptor().time.mid_exposure.ns, 250 * kMs);
  EXPECT_EQ(lighting.age().ns, 50 * kMs);
  // Tolerance: single-precision interpolation between 2 and 3.
  EXPECT_NEAR(lighting.radiance({1, 0, 0}, 0).value.r, 2.5, 1e-5);
  ASSERT_EQ(lighting.lights().size(), 1U);
  EXPECT_NEAR(lighting.lights()[0].irradiance.g, 2.5, 1e-5);
}

TEST(History, AtMidExposureItIsThatDescriptor) {
  const auto history = steady(1, 3);
  const Lighting lighting = lighting_at(history.get(), {200 * kMs}, kMaxAge, kAhead);
  EXPECT_EQ(lighting.descriptor(), test::numbered(2, 200 * kMs));
  EXPECT_EQ(lighting.age().ns, 0);
}

TEST(History, BeforeTheOldestThereIsNone) {
  const Lighting lighting = lighting_at(steady(1, 3).get(), {99 * kMs}, kMaxAge, kAhead);
  EXPECT_EQ(lighting.validity(), Validity::before_history);
  EXPECT_NE(lighting.reason().find("history"), std::string::npos);
  EXPECT_EQ(lighting.irradiance({0, 1, 0}).value, Irradiance{});
}

TEST(History, AfterTheNewestItIsHeldAndBecomesStale) {
  const auto history = steady(1, 3);
  const Lighting soon = lighting_at(history.get(), {400 * kMs}, kMaxAge, kAhead);
  EXPECT_EQ(soon.descriptor().sequence, 3U);
  EXPECT_EQ(soon.validity(), Validity::valid);
  EXPECT_EQ(soon.age().ns, 100 * kMs);
  const Lighting late = lighting_at(history.get(), {600 * kMs}, kMaxAge, kAhead);
  EXPECT_EQ(late.descriptor().sequence, 3U);
  EXPECT_EQ(late.validity(), Validity::stale);
}

/// A light that moves around the horizon at 30 deg/s, in descriptors every 20 ms up to 1 s.
Descriptor lamp_on_its_way(double t_s) {
  const double phi = t_s * 30 * std::numbers::pi / 180;
  Descriptor d = test::constant_scene({1, 1, 1});
  d.lights = {test::light(vec_cast<float>(Vec3d{std::sin(phi), 0, -std::cos(phi)}), {5, 5, 5}, 0.05F, 3)};
  return d;
}
std::shared_ptr<const History> lamp_until_one_second() {
  std::shared_ptr<const History> history;
  for (int i = 0; i <= 50; ++i) history = with(history, lamp_on_its_way(0.02 * i), 20 * kMs * i);
  return history;
}

TEST(History, MovingLightIsExtrapolatedWithinTheLimit) {
  const auto history = lamp_until_one_second();
  for (const std::int64_t ahead : {1, 13, 20, 33, 50}) {
    const Lighting lighting = lighting_at(history.get(), {(1000 + ahead) * kMs}, kMaxAge, kAhead);
    EXPECT_EQ(lighting.derivation(), Derivation::extrapolated);
    EXPECT_EQ(lighting.validity(), Validity::valid);
    EXPECT_EQ(lighting.age().ns, ahead * kMs);
    const Vec3f truth = lamp_on_its_way(1 + 1e-3 * static_cast<double>(ahead)).lights[0].direction;
    EXPECT_LT(angle_between(lighting.lights()[0].direction, truth), 1e-5F) << ahead;
    // The error bound grows by the irradiance error of the extrapolated motion.
    const Descriptor as_it_was = lamp_on_its_way(1);
    double difference = 0, all = 0;
    for (int i = 0; i < 2048; ++i) {
      const Vec3f n = vec_cast<float>(fibonacci_direction(i, 2048));
      const double e = Lighting::of(as_it_was).irradiance(n).value.luminance();
      difference += std::pow(lighting.irradiance(n).value.luminance() - e, 2);
      all += e * e;
    }
    const double added = static_cast<double>(lighting.descriptor().bound.total - as_it_was.bound.total);
    EXPECT_NEAR(added / std::sqrt(difference / all), 1, 0.05) << ahead;
  }
  const Lighting beyond = lighting_at(history.get(), {1051 * kMs}, kMaxAge, kAhead);
  EXPECT_EQ(beyond.derivation(), Derivation::held);
  EXPECT_EQ(beyond.lights()[0].direction, lamp_on_its_way(1).lights[0].direction);
  EXPECT_EQ(lighting_at(history.get(), {1010 * kMs}, kMaxAge, {0}).derivation(), Derivation::held);
}

TEST(History, IrradianceIsNotExtrapolated) {
  std::shared_ptr<const History> history;
  for (int i = 0; i <= 5; ++i) {
    Descriptor d = test::constant_scene({1, 1, 1});
    d.lights = {test::light({0, 1, 0}, Irradiance{1, 1, 1} * (i < 5 ? 0.1F : 9.0F), 0.05F, 3)};
    history = with(history, d, 20 * kMs * i);
  }
  const Lighting lighting = lighting_at(history.get(), {120 * kMs}, kMaxAge, kAhead);
  EXPECT_EQ(lighting.derivation(), Derivation::extrapolated);
  EXPECT_EQ(lighting.lights()[0].irradiance, (Irradiance{9, 9, 9}));
}

TEST(History, NoExtrapolationFromOneSampleAcrossGapsOrOtherUnits) {
  EXPECT_EQ(lighting_at(steady(1, 1).get(), {120 * kMs}, kMaxAge, kAhead).derivation(), Derivation::held);
  auto hole = with(nullptr, lamp_on_its_way(0), 0);
  hole = with(hole, lamp_on_its_way(1), 1000 * kMs);
  EXPECT_EQ(lighting_at(hole.get(), {1020 * kMs}, kMaxAge, kAhead).derivation(), Derivation::held);
  Descriptor absolute = lamp_on_its_way(0.02), relative = lamp_on_its_way(0);
  relative.units = Units::relative;
  EXPECT_EQ(extrapolated(relative, absolute, 1).lights[0].direction, absolute.lights[0].direction);
  // Rotation is limited to pi.
  const Vec3f far = extrapolated(lamp_on_its_way(0), lamp_on_its_way(1), 1e9F).lights[0].direction;
  EXPECT_LT(angle_between(far, lamp_on_its_way(7).lights[0].direction), 1e-5F);
}

TEST(History, ReportsTheDerivation) {
  const auto history = steady(1, 3);
  EXPECT_EQ(lighting_at(history.get(), {200 * kMs}, kMaxAge, kAhead).derivation(), Derivation::measured);
  const Lighting between = lighting_at(history.get(), {250 * kMs}, kMaxAge, kAhead);
  EXPECT_EQ(between.derivation(), Derivation::interpolated);
  EXPECT_EQ(between.rotated({0, 1, 0, 0}).derivation(), Derivation::interpolated);
  EXPECT_EQ(newest_lighting(history.get(), {300 * kMs}, kMaxAge).derivation(), Derivation::measured);
}

TEST(History, ClockUncertaintyCountsTowardsStaleness) {
  Sample sample = sample_of(test::numbered(1, 0));
  sample.time_uncertainty = {100 * kMs};
  const auto history = appended(nullptr, std::make_shared<const Sample>(sample), 8);
  EXPECT_EQ(newest_lighting(history.get(), {150 * kMs}, kMaxAge).validity(), Validity::valid);
  const Lighting perhaps = newest_lighting(history.get(), {151 * kMs}, kMaxAge);
  EXPECT_EQ(perhaps.validity(), Validity::stale);
  EXPECT_EQ(perhaps.age().ns, 151 * kMs);
  EXPECT_EQ(perhaps.age_uncertainty().ns, 100 * kMs);
  EXPECT_NE(perhaps.reason().find("within 100 ms"), std::string::npos) << perhaps.reason();
}

TEST(History, InterpolationAcrossAGapIsStale) {
  auto history = steady(1, 1);
  history = with(history, test::numbered(2, 2'100 * kMs), 2'100 * kMs);
  EXPECT_EQ(lighting_at(history.get(), {1'100 * kMs}, kMaxAge, kAhead).validity(), Validity::stale);
  EXPECT_EQ(lighting_at(history.get(), {2'000 * kMs}, kMaxAge, kAhead).validity(), Validity::valid);
}

TEST(History, KeepsNoMoreThanItsCapacity) {
  const auto history = steady(1, 20, 8);
  ASSERT_EQ(history->samples.size(), 8U);
  EXPECT_EQ(history->samples.front()->descriptor.sequence, 13U);
  EXPECT_EQ(history->samples.back()->descriptor.sequence, 20U);
  EXPECT_EQ(steady(1, 20, 1)->samples.size(), 1U);
}

TEST(History, CorrectedClockKeepsTimesAscending) {
  auto history = steady(1, 5);
  history = with(history, test::numbered(6, 600 * kMs), 350 * kMs);
  ASSERT_EQ(history->samples.size(), 4U);
  EXPECT_EQ(history->samples.back()->descriptor.sequence, 6U);
}

TEST(Interpolate, MatchesLightsByTrack) {
  Descriptor a, b;
  a.lights = {test::light({1, 0, 0}, {4, 4, 4}, 0.1F, 5), test::light({0, 1, 0}, {2, 2, 2}, 0, 6)};
  b.lights = {test::light({0, 1, 0}, {3, 3, 3}, 0, 7), test::light({0, 0, 1}, {8, 8, 8}, 0.3F, 5)};
  const Descriptor half = interpolated(a, b, 0.5F);
  ASSERT_EQ(half.lights.size(), 3U);
  const Light& moving = half.lights[0];
  EXPECT_EQ(moving.track, 5U);
  EXPECT_NEAR(moving.irradiance.r, 6, 1e-6);
  EXPECT_NEAR(moving.angular_radius_rad, 0.2F, 1e-6);
  EXPECT_NEAR(moving.direction.x, std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(moving.direction.z, std::sqrt(0.5), 1e-6);
  EXPECT_EQ(half.lights[1].track, 7U);  // fades in, at half its irradiance
  EXPECT_NEAR(half.lights[1].irradiance.r, 1.5, 1e-6);
  EXPECT_EQ(half.lights[2].track, 6U);  // fades out
  EXPECT_NEAR(half.lights[2].irradiance.r, 1, 1e-6);
}

TEST(Interpolate, LightsWithoutTrackAreNotMatched) {
  Descriptor a, b;
  a.lights = {test::light({1, 0, 0}, {4, 4, 4}, 0, 0)};
  b.lights = {test::light({0, 1, 0}, {4, 4, 4}, 0, 0)};
  EXPECT_EQ(interpolated(a, b, 0.5F).lights.size(), 2U);
}

TEST(Interpolate, MovesAtConstantSpeedAlongTheGreatCircle) {
  Descriptor a, b;
  a.lights = {test::light({1, 0, 0}, {1, 1, 1})};
  b.lights = {test::light({0, 1, 0}, {1, 1, 1})};
  for (const float f : {0.1F, 0.25F, 0.5F, 0.75F, 0.9F}) {
    const Vec3f d = interpolated(a, b, f).lights[0].direction;
    EXPECT_NEAR(std::atan2(d.y, d.x), f * 1.5707963F, 1e-6);
  }
}

TEST(Interpolate, OriginAndDistancesMoveAlongALine) {
  Descriptor a = test::one_light({0, 0, -1}, {1, 1, 1}), b = a;
  a.lights.push_back(test::light({1, 0, 0}, {1, 1, 1}, 0, 2));
  b.lights.push_back(a.lights[1]);
  a.lights[0].distance_m = 0.3F, a.lights[0].distance_sigma_m = 0.01F;
  b.lights[0].distance_m = 0.5F, b.lights[0].distance_sigma_m = 0.03F;
  b.lights[1].distance_m = 2, b.lights[1].distance_sigma_m = 0.5F;
  a.T_probe_origin = {Quat::about({0, 0, 1}, 0.2), {0, 0, -1}};
  b.T_probe_origin = {Quat::about({0, 0, 1}, 1.2), {0.4, 0, -1.4}};
  // The same rotation as a quaternion of the other sign: the way is the shorter one.
  for (const double sign : {1.0, -1.0}) {
    const Quat q = Quat::about({0, 0, 1}, 1.2);
    b.T_probe_origin.rotation = {sign * q.x, sign * q.y, sign * q.z, sign * q.w};
    const Descriptor quarter = interpolated(a, b, 0.25F);
    EXPECT_NEAR(quarter.T_probe_origin.translation.x, 0.1, 1e-12);
    EXPECT_NEAR(quarter.T_probe_origin.translation.z, -1.1, 1e-12);
    const Vec3d turned = rotate(quarter.T_probe_origin.rotation, Vec3d{1, 0, 0});
    EXPECT_NEAR(turned.x, std::cos(0.45), 1e-12);
    EXPECT_NEAR(turned.y, std::sin(0.45), 1e-12);
    ASSERT_EQ(quarter.lights.size(), 2U);
    EXPECT_NEAR(quarter.lights[0].distance_m, 0.35, 1e-6);
    EXPECT_NEAR(quarter.lights[0].distance_sigma_m, 0.015, 1e-7);
    EXPECT_EQ(quarter.lights[1].distance_m, 0) << "not known in the nearer one";
    EXPECT_EQ(interpolated(a, b, 0.75F).lights[1].distance_m, 2);
  }
}

TEST(Interpolate, OppositeDirectionsStayUnit) {
  Descriptor a, b;
  a.lights = {test::light({1, 0, 0}, {1, 1, 1})};
  b.lights = {test::light({-1, 0, 0}, {1, 1, 1})};
  for (const float f : {0.2F, 0.5F, 0.8F}) EXPECT_NEAR(length(interpolated(a, b, f).lights[0].direction), 1, 1e-6);
}

TEST(Interpolate, TakesTheLargerBound) {
  Descriptor a = test::numbered(1, 0), b = test::numbered(2, 10);
  a.bound = {0.1F, 0.05F, 0.2F, 0.01F, 0.4F, 0.02F};
  b.bound = {0.3F, 0.02F, 0.1F, 0.03F, 0.3F, 0.04F};
  a.flags.set(Flag::unseen);
  b.flags.set(Flag::clipped);
  a.coverage = 0.5F;
  const Descriptor half = interpolated(a, b, 0.5F);
  EXPECT_EQ(half.bound, (ErrorBound{0.3F, 0.05F, 0.2F, 0.03F, 0.4F, 0.04F}));
  EXPECT_TRUE(half.flags.has(Flag::unseen));
  EXPECT_TRUE(half.flags.has(Flag::clipped));
  EXPECT_FLOAT_EQ(half.coverage, 0.5F);
}

TEST(Interpolate, DifferentUnitsAreNotInterpolated) {
  Descriptor a = test::numbered(1, 0), b = test::numbered(2, 10);
  a.units = Units::relative;
  EXPECT_EQ(interpolated(a, b, 0.4F), a);
  EXPECT_EQ(interpolated(a, b, 0.6F), b);
}

TEST(Interpolate, MissingBandIsInterpolatedFromZero) {
  Descriptor a = test::constant_scene({1, 1, 1}), b = a;
  b.radiance.band = 2;
  b.radiance.c[4] = {1, 1, 1};
  const Descriptor half = interpolated(a, b, 0.5F);
  EXPECT_EQ(half.radiance.band, 2);
  EXPECT_FLOAT_EQ(half.radiance.c[4].r, 0.5F);
}

TEST(Interpolate, NeverExceedsTheLimitOfLights) {
  Descriptor a, b;
  for (std::uint32_t i = 1; i <= kMaxLights; ++i) {
    a.lights.push_back(test::light({1, 0, 0}, {1, 1, 1}, 0, i));
    b.lights.push_back(test::light({0, 1, 0}, {2, 2, 2}, 0, 100 + i));
  }
  const Descriptor half = interpolated(a, b, 0.5F);
  ASSERT_EQ(half.lights.size(), kMaxLights);
  EXPECT_GT(half.lights.back().track, 100U);
}

}  // namespace
}  // namespace lightwell::core
