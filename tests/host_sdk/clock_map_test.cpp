#include "core/clock_map.hpp"

#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

namespace lightwell::core {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kSecond = 1'000 * kMs;

/// A probe whose clock is `offset` ahead, asked at `sent` over a link with these two delays.
void ask(ClockMap& map, std::int64_t offset, std::int64_t sent, std::int64_t there,
         std::int64_t back) {
  map.add({sent}, {sent + there + offset}, {sent + there + back});
}

TEST(ClockMap, KnowsNothingAtFirst) {
  const ClockMap map;
  EXPECT_FALSE(map.known());
  EXPECT_EQ(map.offset().ns, 0);
  EXPECT_EQ(map.uncertainty({5}).ns, 0);
}

TEST(ClockMap, SymmetricDelaysGiveTheOffsetExactly) {
  for (const std::int64_t offset : {std::int64_t{0}, 123 * kSecond, -7 * kSecond}) {
    ClockMap map;
    ask(map, offset, 1'000 * kSecond, 2 * kMs, 2 * kMs);
    ASSERT_TRUE(map.known());
    EXPECT_EQ(map.offset().ns, offset);
    EXPECT_NEAR(static_cast<double>(map.uncertainty({1'000 * kSecond}).ns), 2e6, 2);
    EXPECT_EQ(map.to_host({500 * kSecond + offset}).ns, 500 * kSecond);
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
    EXPECT_LE(std::llabs(map.offset().ns - offset), map.uncertainty(now).ns) << i;
  }
}

TEST(ClockMap, OneSlowAnswerSpoilsNothing) {
  ClockMap map;
  ask(map, kSecond, 10 * kSecond, kMs, kMs);
  ask(map, kSecond, 11 * kSecond, kMs, 300 * kMs);
  EXPECT_EQ(map.offset().ns, kSecond);
  EXPECT_LT(map.uncertainty({11 * kSecond}).ns, 2 * kMs);
}

TEST(ClockMap, AQuickerAnswerImproves) {
  ClockMap map;
  ask(map, kSecond, 10 * kSecond, kMs, 9 * kMs);
  EXPECT_EQ(map.offset().ns, kSecond - 4 * kMs);
  ask(map, kSecond, 11 * kSecond, kMs, kMs);
  EXPECT_EQ(map.offset().ns, kSecond);
}

TEST(ClockMap, AgeMakesItLessCertainAndFollowsDrift) {
  // The probe's quartz runs 80 ppm fast: within what the map allows for.
  ClockMap map;
  double worst = 0;
  for (int i = 0; i <= 600; ++i) {
    const std::int64_t sent = kSecond * i;
    const std::int64_t offset =
        5 * kSecond + static_cast<std::int64_t>(80e-6 * static_cast<double>(sent));
    ask(map, offset, sent, kMs, i % 10 == 0 ? kMs : 4 * kMs);
    const HostTime now{sent + 5 * kMs};
    const auto error = static_cast<double>(std::llabs(map.offset().ns - offset));
    EXPECT_LE(error, static_cast<double>(map.uncertainty(now).ns) + 1e3) << i;
    worst = std::max(worst, error);
  }
  // Ten minutes of drift are 48 ms; ten seconds of it, until the next quick answer, are 0.8 ms.
  EXPECT_LT(worst, 2.5e6);
}

TEST(ClockMap, AClockThatWasSetAnewIsBelievedAtOnce) {
  ClockMap map;
  ask(map, 100 * kSecond, 10 * kSecond, kMs, kMs);
  ask(map, -3 * kSecond, 11 * kSecond, 5 * kMs, 5 * kMs);  // rebooted, over a slower link
  EXPECT_EQ(map.offset().ns, -3 * kSecond);
}

TEST(ClockMap, AnAnswerBeforeTheQuestionIsPassedOver) {
  ClockMap map;
  map.add({10}, {5}, {9});
  EXPECT_FALSE(map.known());
}

}  // namespace
}  // namespace lightwell::core
