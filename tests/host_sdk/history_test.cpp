// What was when: interpolation between descriptors, and the ends of what is kept.
#include "core/history.hpp"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "core/interpolate.hpp"
#include "host_sdk/scenes.hpp"

namespace lightwell::core {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr Duration kMaxAge{250 * kMs};

std::shared_ptr<const History> with(std::shared_ptr<const History> history, Descriptor descriptor,
                                    std::int64_t host_ns, std::size_t capacity = 64) {
  Sample sample = sample_of(std::move(descriptor));
  sample.mid_exposure = {host_ns};
  return appended(history.get(), std::make_shared<const Sample>(std::move(sample)), capacity);
}

/// Sequence n at n * 100 ms, brightness n.
std::shared_ptr<const History> steady(std::uint64_t first, std::uint64_t last,
                                      std::size_t capacity = 64) {
  std::shared_ptr<const History> history;
  for (std::uint64_t n = first; n <= last; ++n) {
    const auto t = static_cast<std::int64_t>(n) * 100 * kMs;
    history = with(history, test::numbered(n, t), t, capacity);
  }
  return history;
}

TEST(History, NothingBeforeTheFirst) {
  EXPECT_EQ(newest_lighting(nullptr, {0}, kMaxAge).validity(), Validity::none);
  EXPECT_EQ(lighting_at(nullptr, {0}, kMaxAge).validity(), Validity::none);
}

TEST(History, NewestTellsItsAge) {
  const auto history = steady(1, 3);
  const Lighting lighting = newest_lighting(history.get(), {340 * kMs}, kMaxAge);
  EXPECT_EQ(lighting.descriptor().sequence, 3U);
  EXPECT_EQ(lighting.age().ns, 40 * kMs);
  EXPECT_EQ(lighting.validity(), Validity::valid);
  EXPECT_EQ(newest_lighting(history.get(), {551 * kMs}, kMaxAge).validity(), Validity::stale);
  // A clock that is a little off must not make light from the future.
  EXPECT_EQ(newest_lighting(history.get(), {299 * kMs}, kMaxAge).age().ns, 0);
}

TEST(History, HalfWayIsTheMean) {
  const Lighting lighting = lighting_at(steady(1, 3).get(), {250 * kMs}, kMaxAge);
  EXPECT_EQ(lighting.validity(), Validity::valid);
  EXPECT_EQ(lighting.mid_exposure().ns, 250 * kMs);
  EXPECT_EQ(lighting.descriptor().time.mid_exposure.ns, 250 * kMs);
  EXPECT_EQ(lighting.age().ns, 50 * kMs);
  // Single-precision blends of 2 and 3.
  EXPECT_NEAR(lighting.radiance({1, 0, 0}, 0).value.r, 2.5, 1e-5);
  ASSERT_EQ(lighting.lights().size(), 1U);
  EXPECT_NEAR(lighting.lights()[0].irradiance.g, 2.5, 1e-5);
}

TEST(History, AtAnExposureItIsThatDescriptor) {
  const auto history = steady(1, 3);
  const Lighting lighting = lighting_at(history.get(), {200 * kMs}, kMaxAge);
  EXPECT_EQ(lighting.descriptor(), test::numbered(2, 200 * kMs));
  EXPECT_EQ(lighting.age().ns, 0);
}

TEST(History, BeforeTheOldestThereIsNone) {
  const Lighting lighting = lighting_at(steady(1, 3).get(), {99 * kMs}, kMaxAge);
  EXPECT_EQ(lighting.validity(), Validity::before_history);
  EXPECT_NE(lighting.reason().find("history"), std::string::npos);
  EXPECT_EQ(lighting.irradiance({0, 1, 0}).value, Irradiance{});
}

TEST(History, AfterTheNewestItIsHeldAndGrowsStale) {
  const auto history = steady(1, 3);
  const Lighting soon = lighting_at(history.get(), {400 * kMs}, kMaxAge);
  EXPECT_EQ(soon.descriptor().sequence, 3U);
  EXPECT_EQ(soon.validity(), Validity::valid);
  EXPECT_EQ(soon.age().ns, 100 * kMs);
  const Lighting late = lighting_at(history.get(), {600 * kMs}, kMaxAge);
  EXPECT_EQ(late.descriptor().sequence, 3U);
  EXPECT_EQ(late.validity(), Validity::stale);
}

TEST(History, AcrossAHoleItIsStale) {
  auto history = steady(1, 1);
  history = with(history, test::numbered(2, 2'100 * kMs), 2'100 * kMs);
  EXPECT_EQ(lighting_at(history.get(), {1'100 * kMs}, kMaxAge).validity(), Validity::stale);
  EXPECT_EQ(lighting_at(history.get(), {2'000 * kMs}, kMaxAge).validity(), Validity::valid);
}

TEST(History, KeepsNoMoreThanItsCapacity) {
  const auto history = steady(1, 20, 8);
  ASSERT_EQ(history->samples.size(), 8U);
  EXPECT_EQ(history->samples.front()->descriptor.sequence, 13U);
  EXPECT_EQ(history->samples.back()->descriptor.sequence, 20U);
  EXPECT_EQ(steady(1, 20, 1)->samples.size(), 1U);
}

TEST(History, ACorrectedClockLeavesTimeAscending) {
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
  EXPECT_EQ(half.lights[1].track, 7U);  // comes, at half its strength
  EXPECT_NEAR(half.lights[1].irradiance.r, 1.5, 1e-6);
  EXPECT_EQ(half.lights[2].track, 6U);  // goes
  EXPECT_NEAR(half.lights[2].irradiance.r, 1, 1e-6);
}

TEST(Interpolate, LightsWithoutTrackAreNeverTheSame) {
  Descriptor a, b;
  a.lights = {test::light({1, 0, 0}, {4, 4, 4}, 0, 0)};
  b.lights = {test::light({0, 1, 0}, {4, 4, 4}, 0, 0)};
  EXPECT_EQ(interpolated(a, b, 0.5F).lights.size(), 2U);
}

TEST(Interpolate, MovesAtAnEvenPaceAlongTheGreatCircle) {
  Descriptor a, b;
  a.lights = {test::light({1, 0, 0}, {1, 1, 1})};
  b.lights = {test::light({0, 1, 0}, {1, 1, 1})};
  for (const float f : {0.1F, 0.25F, 0.5F, 0.75F, 0.9F}) {
    const Vec3f d = interpolated(a, b, f).lights[0].direction;
    EXPECT_NEAR(std::atan2(d.y, d.x), f * 1.5707963F, 1e-6);
  }
}

TEST(Interpolate, OppositeDirectionsStayUnit) {
  Descriptor a, b;
  a.lights = {test::light({1, 0, 0}, {1, 1, 1})};
  b.lights = {test::light({-1, 0, 0}, {1, 1, 1})};
  for (const float f : {0.2F, 0.5F, 0.8F})
    EXPECT_NEAR(length(interpolated(a, b, f).lights[0].direction), 1, 1e-6);
}

TEST(Interpolate, TakesTheWorseOfBounds) {
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

TEST(Interpolate, DifferentUnitsDoNotBlend) {
  Descriptor a = test::numbered(1, 0), b = test::numbered(2, 10);
  a.units = Units::relative;
  EXPECT_EQ(interpolated(a, b, 0.4F), a);
  EXPECT_EQ(interpolated(a, b, 0.6F), b);
}

TEST(Interpolate, ABandThatOneLacksComesFromZero) {
  Descriptor a = test::constant_scene({1, 1, 1}), b = a;
  b.radiance.band = 2;
  b.radiance.c[4] = {1, 1, 1};
  const Descriptor half = interpolated(a, b, 0.5F);
  EXPECT_EQ(half.radiance.band, 2);
  EXPECT_FLOAT_EQ(half.radiance.c[4].r, 0.5F);
}

TEST(Interpolate, NeverMakesMoreLightsThanADescriptorHolds) {
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
