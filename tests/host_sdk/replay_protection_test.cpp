#include <limits>

#include <gtest/gtest.h>

#include "core/clock_map.hpp"

namespace lightwell::core {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kNow = 5'000 * kMs;

/// The probe's clock is a second ahead of the host's, measured by a round trip of 10 ms (uncertainty 5 ms).
ClockMap a_second_ahead() {
  ClockMap clock;
  clock.add({kNow - 10 * kMs}, {kNow - 5 * kMs + 1'000 * kMs}, {kNow});
  return clock;
}

TEST(ReplayProtection, MapsToTheHostsClock) {
  ReplayProtection gate;
  const auto at = gate.admit({kNow + 900 * kMs}, {kNow}, a_second_ahead());
  ASSERT_TRUE(at);
  EXPECT_EQ(at->at.ns, kNow - 100 * kMs);
  EXPECT_EQ(at->uncertainty, a_second_ahead().uncertainty({kNow})) << "the clock uncertainty is included";
}

TEST(ReplayProtection, RejectsEarlierDescriptors) {
  ReplayProtection gate;
  const ClockMap clock = a_second_ahead();
  ASSERT_TRUE(gate.admit({kNow + 900 * kMs}, {kNow}, clock));
  EXPECT_FALSE(gate.admit({kNow + 900 * kMs}, {kNow}, clock)) << "the same again";
  EXPECT_FALSE(gate.admit({kNow + 899 * kMs}, {kNow}, clock)) << "an older one";
  EXPECT_FALSE(gate.admit({0}, {kNow}, clock)) << "the oldest";
  EXPECT_TRUE(gate.admit({kNow + 901 * kMs}, {kNow}, clock));
}

TEST(ReplayProtection, RejectsDescriptorsFromTheFuture) {
  ReplayProtection gate;
  const ClockMap clock = a_second_ahead();
  EXPECT_TRUE(gate.admit({kNow + 1'004 * kMs}, {kNow}, clock)) << "within the clock uncertainty";
  EXPECT_FALSE(gate.admit({kNow + 1'006 * kMs}, {kNow}, clock));
  EXPECT_FALSE(gate.admit({kNow + 3'600'000 * kMs}, {kNow}, clock));
  EXPECT_TRUE(gate.admit({kNow + 1'005 * kMs}, {kNow + 10 * kMs}, clock))
      << "a rejected descriptor does not change the state";
}

TEST(ReplayProtection, RejectsTimesOutOfRange) {
  ReplayProtection gate;
  const ClockMap clock = a_second_ahead();
  EXPECT_FALSE(gate.admit({-1}, {kNow}, clock));
  EXPECT_FALSE(gate.admit({std::numeric_limits<std::int64_t>::max()}, {kNow}, clock));
  EXPECT_FALSE(gate.admit({std::numeric_limits<std::int64_t>::min()}, {kNow}, clock));
}

TEST(ReplayProtection, ForgetAcceptsARestartedProbe) {
  ReplayProtection gate;
  ASSERT_TRUE(gate.admit({kNow + 900 * kMs}, {kNow}, a_second_ahead()));
  ClockMap rebooted;
  rebooted.add({kNow}, {20 * kMs}, {kNow + 10 * kMs});
  EXPECT_FALSE(gate.admit({15 * kMs}, {kNow + 10 * kMs}, rebooted));
  gate.forget();
  EXPECT_TRUE(gate.admit({15 * kMs}, {kNow + 10 * kMs}, rebooted));
}

}  // namespace
}  // namespace lightwell::core
