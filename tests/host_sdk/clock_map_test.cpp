#include "core/clock_map.hpp"

#include <cstdlib>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace lightwell::core {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kSecond = 1'000 * kMs;

/// Adds a round trip to a probe whose clock is `offset` ahead, sent at `sent`, over a link with these two delays.
void ask(ClockMap& map, std::int64_t offset, std::int64_t sent, std::int64_t there, std::int64_t back) {
  map.add({sent}, {sent + there + offset}, {sent + there + back});
}

TEST(ClockMap, IsUnknownInitially) {
  const ClockMap map;
  EXPECT_FALSE(map.known());
  EXPECT_EQ(map.offset({5}).ns, 0);
  EXPECT_EQ(map.uncertainty({5}).ns, 0);
}

TEST(ClockMap, SymmetricDelaysGiveTheOffsetExactly) {
  for (const std::int64_t offset : {std::int64_t{0}, 123 * kSecond, -7 * kSecond}) {
    ClockMap map;
    ask(map, offset, 1'000 * kSecond, 2 * kMs, 2 * kMs);
    ASSERT_TRUE(map.known());
    EXPECT_NEAR(static_cast<double>(map.offset({1'000 * kSecond}).ns - offset), 0, 2);
    EXPECT_NEAR(static_cast<double>(map.uncertainty({1'000 * kSecond + 4 * kMs}).ns), 2e6, 4);
    EXPECT_NEAR(static_cast<double>(map.to_host({500 * kSecond + offset}).ns - 500 * kSecond), 0, 2);
  }
}

TEST(ClockMap, TheTruthIsAlwaysWithinTheUncertainty) {
  std::minstd_rand random(1);
  std::exponential_distribution<double> delay_ms(0.5);
  const std::int64_t offset = 42 * kSecond;
  ClockMap map;
  for (int i = 0; i < 1'000; ++i) {
    const std::int64_t sent = kSecond * (10 + i);
    const auto there = static_cast<std::int64_t>(delay_ms(random) * 1e6);
    const auto back = static_cast<std::int64_t>(delay_ms(random) * 1e6);
    ask(map, offset, sent, there, back);
    const HostTime now{sent + there + back};
    EXPECT_LE(std::llabs(map.offset(now).ns - offset), map.uncertainty(now).ns) << i;
  }
}

TEST(ClockMap, SlowRoundTripDoesNotIncreaseTheUncertainty) {
  ClockMap map;
  ask(map, kSecond, 10 * kSecond, kMs, kMs);
  ask(map, kSecond, 11 * kSecond, kMs, 300 * kMs);
  EXPECT_NEAR(static_cast<double>(map.offset({11 * kSecond}).ns - kSecond), 0, 0.2 * kMs);
  EXPECT_LT(map.uncertainty({11 * kSecond}).ns, 2 * kMs);
}

TEST(ClockMap, FasterRoundTripReducesTheUncertainty) {
  ClockMap map;
  ask(map, kSecond, 10 * kSecond, kMs, 9 * kMs);
  EXPECT_NEAR(static_cast<double>(map.offset({10 * kSecond + 10 * kMs}).ns - (kSecond - 4 * kMs)), 0, 2);
  ask(map, kSecond, 11 * kSecond, kMs, kMs);
  EXPECT_NEAR(static_cast<double>(map.offset({11 * kSecond}).ns - kSecond), 0, 0.2 * kMs);
}

TEST(ClockMap, UncertaintyGrowsWithAgeAndDriftIsFollowed) {
  // The probe's quartz runs 80 ppm fast: within what the map allows for.
  ClockMap map;
  double worst = 0;
  for (int i = 0; i <= 600; ++i) {
    const std::int64_t sent = kSecond * i;
    const std::int64_t offset = 5 * kSecond + static_cast<std::int64_t>(80e-6 * static_cast<double>(sent));
    ask(map, offset, sent, kMs, i % 10 == 0 ? kMs : 4 * kMs);
    const HostTime now{sent + 5 * kMs};
    const auto error =
        static_cast<double>(std::llabs(map.offset(now).ns - offset - static_cast<std::int64_t>(80e-6 * 5e6)));
    EXPECT_LE(error, static_cast<double>(map.uncertainty(now).ns) + 1e3) << i;
    worst = std::max(worst, error);
  }
  // Ten minutes of drift are 48 ms; ten seconds of drift, until the next fast round trip, are 0.8 ms.
  EXPECT_LT(worst, 2.5e6);
}

TEST(ClockMap, ClockResetIsFollowedAtOnce) {
  ClockMap map;
  ask(map, 100 * kSecond, 10 * kSecond, kMs, kMs);
  ask(map, -3 * kSecond, 11 * kSecond, 5 * kMs, 5 * kMs);  // rebooted, over a slower link
  EXPECT_NEAR(static_cast<double>(map.offset({11 * kSecond + 10 * kMs}).ns + 3 * kSecond), 0, 2);
}

/// Two minutes of round trips with a probe whose clock is fast by `ppm`, over a link with random delays each way.
ClockMap asked_for_two_minutes(double ppm, std::uint32_t seed,
                               std::int64_t (*offset_at)(double ppm, std::int64_t host)) {
  std::minstd_rand random(seed);
  std::exponential_distribution<double> delay_ms(2);
  ClockMap map;
  for (int i = 0; i <= 120; ++i) {
    const std::int64_t sent = kSecond * i, there = static_cast<std::int64_t>(1e5 + delay_ms(random) * 1e6),
                       back = static_cast<std::int64_t>(1e5 + delay_ms(random) * 1e6);
    ask(map, offset_at(ppm, sent + there), sent, there, back);
  }
  return map;
}
std::int64_t steady(double ppm, std::int64_t host) {
  return 7 * kSecond + static_cast<std::int64_t>(1e-6 * ppm * static_cast<double>(host));
}

TEST(ClockMap, DriftIsKnownAfterTwoMinutesAndCarriesOverAnOutage) {
  for (const double ppm : {-95.0, -20.0, 0.0, 3.0, 80.0}) {
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
      const ClockMap map = asked_for_two_minutes(ppm, seed, steady);
      EXPECT_NEAR(1e6 * map.drift(), ppm, 8) << seed;
      // A minute without round trips; a drift of 100 ppm alone would be 6 ms.
      const HostTime later{180 * kSecond};
      EXPECT_LE(std::llabs(map.offset(later).ns - steady(ppm, later.ns)), map.uncertainty(later).ns)
          << ppm << " " << seed;
      EXPECT_LT(map.uncertainty(later).ns, 1.5 * kMs) << ppm << " " << seed;
      const ProbeTime probe{later.ns + steady(ppm, later.ns)};
      EXPECT_LE(std::llabs(map.to_host(probe).ns - later.ns), map.uncertainty(later).ns) << ppm << " " << seed;
    }
  }
}

TEST(ClockMap, TheTruthIsWithinTheUncertaintyWithVaryingDrift) {
  // The drift varies by 1 ppm with a period of four minutes, which kMaxDriftChange allows.
  const auto wandering = [](double ppm, std::int64_t host) {
    const double t = 1e-9 * static_cast<double>(host);
    return steady(ppm, host) + static_cast<std::int64_t>(1e9 * 0.5e-6 * 38 * std::sin(t / 38));
  };
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    const ClockMap map = asked_for_two_minutes(40, seed, wandering);
    const HostTime now{121 * kSecond};
    EXPECT_LE(std::llabs(map.offset(now).ns - wandering(40, now.ns)), map.uncertainty(now).ns) << seed;
  }
}

TEST(ClockMap, AClockJumpDiscardsOldRoundTrips) {
  ClockMap map = asked_for_two_minutes(50, 1, steady);
  // The host was suspended for an hour, which CLOCK_MONOTONIC does not count.
  for (int i = 0; i < 3; ++i) {
    const std::int64_t sent = kSecond * (121 + i);
    ask(map, 3'607 * kSecond, sent, kMs, kMs);
    const HostTime now{sent + 2 * kMs};
    EXPECT_LE(std::llabs(map.offset(now).ns - 3'607 * kSecond), map.uncertainty(now).ns);
    EXPECT_LT(map.uncertainty(now).ns, 2 * kMs);
  }
}

TEST(ClockMap, ExtremeTimesDoNotOverflow) {
  constexpr std::int64_t kEnd = std::int64_t{1} << 60;
  ClockMap map;
  map.add({kEnd - 1000}, {-kEnd + 5000}, {kEnd});
  EXPECT_TRUE(map.known());
  EXPECT_LE(std::llabs(map.to_host({-kEnd + 5000}).ns - kEnd), 2000);
  map.add({0}, {0}, {1});  // Before the last round trip: ignored.
  EXPECT_LE(std::llabs(map.to_host({-kEnd + 5000}).ns - kEnd), 2000);
  map.forget();
  EXPECT_FALSE(map.known());
  // Invalid clock values of a hostile probe.
  map.add({5}, {std::numeric_limits<std::int64_t>::min()}, {6});
  map.add({5}, {std::numeric_limits<std::int64_t>::max()}, {6});
  EXPECT_FALSE(map.known());
  map.add({5}, {5}, {5});
  EXPECT_GT(map.to_host({std::numeric_limits<std::int64_t>::max()}).ns, kEnd);
  EXPECT_LT(map.to_host({std::numeric_limits<std::int64_t>::min()}).ns, -kEnd);
  EXPECT_LE(map.uncertainty({5}).ns, 4);
}

TEST(ClockMap, ResponseBeforeTheRequestIsIgnored) {
  ClockMap map;
  map.add({10}, {5}, {9});
  EXPECT_FALSE(map.known());
}

}  // namespace
}  // namespace lightwell::core
