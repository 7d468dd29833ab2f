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

using Verdict = PlaneReplayProtection::Verdict;

TEST(PlaneReplayProtection, AdmitsAllMessagesOfACapture) {
  PlaneReplayProtection gate;
  const ClockMap clock = a_second_ahead();
  EXPECT_EQ(gate.admit(7, {kNow + 900 * kMs}, {kNow}, clock), Verdict::other_capture) << "the first";
  EXPECT_EQ(gate.admit(7, {kNow + 900 * kMs}, {kNow}, clock), Verdict::same_capture) << "of the same frame";
  EXPECT_EQ(gate.admit(7, {kNow + 800 * kMs}, {kNow}, clock), Verdict::same_capture) << "late";
  EXPECT_EQ(gate.admit(7, {kNow + 950 * kMs}, {kNow}, clock), Verdict::same_capture);
}

TEST(PlaneReplayProtection, RejectsEarlierCapturesAndTheFuture) {
  PlaneReplayProtection gate;
  const ClockMap clock = a_second_ahead();
  ASSERT_EQ(gate.admit(7, {kNow + 900 * kMs}, {kNow}, clock), Verdict::other_capture);
  ASSERT_EQ(gate.admit(7, {kNow + 100 * kMs}, {kNow}, clock), Verdict::same_capture);
  EXPECT_EQ(gate.admit(8, {kNow + 900 * kMs}, {kNow}, clock), Verdict::refused) << "not later than all of this one";
  EXPECT_EQ(gate.admit(8, {kNow + 1'006 * kMs}, {kNow}, clock), Verdict::refused) << "from the future";
  EXPECT_EQ(gate.admit(7, {kNow + 3'600'000 * kMs}, {kNow}, clock), Verdict::refused);
  EXPECT_EQ(gate.admit(7, {-1}, {kNow}, clock), Verdict::refused);
  EXPECT_EQ(gate.admit(7, {std::numeric_limits<std::int64_t>::max()}, {kNow}, clock), Verdict::refused);
  EXPECT_EQ(gate.admit(8, {kNow + 901 * kMs}, {kNow + 999 * kMs}, clock), Verdict::refused) << "too soon";
  EXPECT_EQ(gate.admit(8, {kNow + 901 * kMs}, {kNow + 1'000 * kMs}, clock), Verdict::other_capture);
  EXPECT_EQ(gate.admit(7, {kNow + 900 * kMs}, {kNow + 3'000 * kMs}, clock), Verdict::refused)
      << "the former one, again";
}

/// A forged message of a capture that does not exist excludes the probe's until its next frame, or for kCaptureTimeout.
TEST(PlaneReplayProtection, AForgedCaptureIsReplaced) {
  PlaneReplayProtection gate;
  const ClockMap clock = a_second_ahead();
  const auto at = [](std::int64_t ms) { return HostTime{kNow + ms * kMs}; };
  ASSERT_EQ(gate.admit(7, {kNow - 200 * kMs}, at(-1'000), clock), Verdict::other_capture);
  ASSERT_EQ(gate.admit(7, {kNow + 900 * kMs}, at(0), clock), Verdict::same_capture);
  ASSERT_EQ(gate.admit(666, {kNow + 1'000 * kMs}, at(0), clock), Verdict::other_capture);
  EXPECT_EQ(gate.admit(7, {kNow + 900 * kMs}, at(2'000), clock), Verdict::refused);
  const std::int64_t silence = PlaneReplayProtection::kCaptureTimeout.ns / kMs;
  EXPECT_EQ(gate.admit(7, {kNow + 900 * kMs}, at(silence), clock), Verdict::refused);
  EXPECT_EQ(gate.admit(7, {kNow + 900 * kMs}, at(silence + 1), clock), Verdict::other_capture);
  // A frame that contributes ends it at once.
  ASSERT_EQ(gate.admit(667, {kNow + 2'000 * kMs}, at(silence + 1'001), clock), Verdict::other_capture);
  EXPECT_EQ(gate.admit(7, {kNow + 2'001 * kMs}, at(silence + 2'001), clock), Verdict::other_capture);
}

TEST(PlaneReplayProtection, ForgetAcceptsARestartedProbe) {
  PlaneReplayProtection gate;
  ASSERT_EQ(gate.admit(7, {kNow + 900 * kMs}, {kNow}, a_second_ahead()), Verdict::other_capture);
  ClockMap rebooted;
  rebooted.add({kNow}, {20 * kMs}, {kNow + 10 * kMs});
  EXPECT_EQ(gate.admit(8, {15 * kMs}, {kNow + 2'000 * kMs}, rebooted), Verdict::refused);
  gate.forget();
  EXPECT_EQ(gate.admit(8, {15 * kMs}, {kNow + 10 * kMs}, rebooted), Verdict::other_capture);
}

}  // namespace
}  // namespace lightwell::core
