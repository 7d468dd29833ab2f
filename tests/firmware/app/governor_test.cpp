// Whole lives of a governor, simulated: what each setting costs, the load of the machine, noise, and what came of it.
#include "app/governor.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace lightwell {
namespace {

constexpr double kBudget = 10;
constexpr std::uint64_t kSecond = 30, kHour = 3600 * kSecond;  // estimates

/// A machine: an estimate takes cost * load, times e to a normal number of deviation `noise`.
struct Machine {
  std::array<double, 3> cost_ms{2, 5, 12};  ///< fast, balanced, exact
  double noise = 0;
  std::function<double(std::uint64_t)> load = [](std::uint64_t) { return 1.0; };
};

struct Life {
  explicit Life(Machine m, Setting richest = Setting::exact, double budget = kBudget)
      : machine(std::move(m)), governor(budget, richest) {}

  void run(std::uint64_t estimates) {
    for (std::uint64_t i = 0; i < estimates; ++i, ++at) {
      const Setting setting = governor.setting();
      const auto s = static_cast<std::size_t>(setting) - 1;
      double ms = machine.cost_ms[s] * machine.load(at);
      if (machine.noise > 0) ms *= std::exp(machine.noise * normal(random));
      ++spent[s];
      late += ms > kBudget ? 1 : 0;
      governor.record_duration(ms);
    }
  }
  [[nodiscard]] std::uint64_t moves() const { return governor.counts().moves; }

  Machine machine;
  Governor governor;
  std::mt19937_64 random{20240607};
  std::normal_distribution<double> normal;
  std::uint64_t at = 0, late = 0;
  std::array<std::uint64_t, 3> spent{};
};

TEST(Governor, WithoutABudgetIsNeverMoved) {
  Life life({.cost_ms = {1e3, 1e4, 1e5}}, Setting::exact, 0);
  life.run(1000);
  EXPECT_EQ(life.governor.setting(), Setting::exact);
  EXPECT_EQ(life.governor.counts().late, 0U);
}

TEST(Governor, WithRoomStaysAsConfigured) {
  for (const Setting richest : kSettings) {
    Life life({.cost_ms = {1, 2, 4}, .noise = 0.1}, richest);
    life.run(kHour);
    EXPECT_EQ(life.governor.setting(), richest);
    EXPECT_EQ(life.moves(), 0U);
  }
}

TEST(Governor, FallsAtOnceWhereTheBudgetIsExceededByFar) {
  Life life({.cost_ms = {7, 9, 16}});
  life.run(2);
  EXPECT_EQ(life.governor.setting(), Setting::balanced);
  Life farther({.cost_ms = {8, 12, 30}});
  farther.run(2);
  EXPECT_EQ(farther.governor.setting(), Setting::fast)
      << "over the setting between, which would not have fitted either";
}

TEST(Governor, FallsWithinAFewFramesWhereItIsExceededByLittle) {
  Life life({.cost_ms = {2, 5, 11}});
  life.run(3);
  EXPECT_EQ(life.governor.setting(), Setting::balanced);
}

TEST(Governor, ALoadThatRisesAndFallsIsFollowed) {
  // Twice the load from second 20 to second 80.
  Life life({.cost_ms = {4, 6, 9},
             .noise = 0.02,
             .load = [](std::uint64_t i) { return i >= 20 * kSecond && i < 80 * kSecond ? 2.0 : 1.0; }},
            Setting::balanced);
  life.run(20 * kSecond);
  EXPECT_EQ(life.governor.setting(), Setting::balanced);
  life.run(4);
  EXPECT_EQ(life.governor.setting(), Setting::fast);
  life.run(60 * kSecond - 4);
  EXPECT_EQ(life.governor.setting(), Setting::fast);
  EXPECT_LE(life.late, 4U) << "what it took to notice, and no more";
  life.run(4 * kSecond);
  EXPECT_EQ(life.governor.setting(), Setting::balanced) << "there is room again";
  EXPECT_EQ(life.moves(), 2U);
}

TEST(Governor, SettlesOnTheRichestThatFits) {
  Life life({.noise = 0.05});
  life.run(60 * kSecond);
  EXPECT_EQ(life.governor.setting(), Setting::balanced);
  EXPECT_GT(life.spent[1], 55 * kSecond);
}

TEST(Governor, BetweenTwoSettingsForAnHourItMovesAHandfulOfTimes) {
  for (const double noise : {0.0, 0.05, 0.2}) {
    for (const double richer : {10.2, 12.0, 15.0, 25.0}) {
      Life life({.cost_ms = {6, richer, 4 * richer}, .noise = noise}, Setting::balanced);
      life.run(kHour);
      EXPECT_LE(life.moves(), 7U) << "noise " << noise << ", balanced takes " << richer;
      EXPECT_LT(life.late, kHour / 50) << "noise " << noise << ", balanced takes " << richer;
    }
  }
}

TEST(Governor, ARicherSettingThatBarelyFitsDoesNotSwing) {
  for (const double richer : {6.5, 7.0, 7.5, 8.0, 8.5, 9.0, 9.5, 9.9}) {
    for (const double noise : {0.02, 0.08, 0.15, 0.2, 0.25}) {
      Life life({.cost_ms = {3, richer, 30}, .noise = noise}, Setting::balanced);
      life.run(kHour);
      EXPECT_LE(life.moves(), 16U) << "patience grows by powers of two: " << richer << " ms, noise " << noise;
      EXPECT_LT(static_cast<double>(life.late), 0.06 * static_cast<double>(kHour)) << richer << " ms, noise " << noise;
    }
  }
}

TEST(Governor, NoiseAndSingleSpikesMoveNothing) {
  Life life({.noise = 0.1, .load = [](std::uint64_t i) { return i % 97 == 50 ? 8.0 : 1.0; }}, Setting::balanced);
  life.run(kHour);
  EXPECT_EQ(life.moves(), 0U);
  EXPECT_EQ(life.late, life.governor.counts().late);
}

TEST(Governor, RandomSpikesAreBorneOrForgiven) {
  std::mt19937_64 dice(5);
  Life life({.noise = 0.1, .load = [&](std::uint64_t) { return dice() % 200 == 0 ? 5.0 : 1.0; }}, Setting::balanced);
  life.run(kHour);
  EXPECT_GT(life.spent[1], kHour * 98 / 100);
  EXPECT_LE(life.moves(), 20U) << "two in succession are rare";
}

TEST(Governor, ALoadThatComesAndGoesIsNotChasedForEver) {
  // Two seconds of load, three without: too short for a climb that lasts.
  Life life({.noise = 0.05, .load = [](std::uint64_t i) { return i % (5 * kSecond) < 2 * kSecond ? 3.0 : 1.0; }},
            Setting::balanced);
  life.run(kHour);
  EXPECT_LE(life.moves(), 8U);
  EXPECT_LT(life.late, 50U);
  // Then it is quiet for good.
  life.machine.load = [](std::uint64_t) { return 1.0; };
  life.run(10 * 60 * kSecond);
  EXPECT_EQ(life.governor.setting(), Setting::balanced);
}

TEST(Governor, AClimbThatFailedIsTriedAgainWhenTheCauseIsGone) {
  Life life({.cost_ms = {3, 14, 40}}, Setting::balanced);
  life.run(10 * 60 * kSecond);
  EXPECT_EQ(life.governor.setting(), Setting::fast);
  life.machine.cost_ms = {3, 6, 40};  // Another scene, in which the richer setting costs less.
  life.run(kHour);
  EXPECT_EQ(life.governor.setting(), Setting::balanced);
}

TEST(Governor, RandomLoadsKeepTheDeadlineInTheLongRun) {
  // Each few seconds to minutes another load, from idle to three times what fast can bear with room.
  for (unsigned seed = 1; seed <= 8; ++seed) {
    std::mt19937_64 random(seed);
    double load = 1;
    std::uint64_t until = 0, changes = 0;
    Life life({.noise = 0.08, .load = [&](std::uint64_t i) {
                 if (i >= until) {
                   load = std::exp2(std::uniform_real_distribution<double>(-1, 2)(random));
                   until = i + std::uniform_int_distribution<std::uint64_t>(3 * kSecond, 120 * kSecond)(random);
                   ++changes;
                 }
                 return load;
               }});
    life.run(kHour);
    EXPECT_LT(static_cast<double>(life.late), 0.01 * static_cast<double>(kHour)) << "seed " << seed;
    EXPECT_LE(life.moves(), 3 * changes) << "seed " << seed;
    EXPECT_GT(life.spent[1] + life.spent[2], kHour / 3) << "seed " << seed << ": room is used";
  }
}

TEST(Governor, SaysWhereEvenFastIsLate) {
  Life life({.cost_ms = {11, 20, 40}});
  life.run(100);
  EXPECT_EQ(life.governor.setting(), Setting::fast);
  EXPECT_TRUE(life.governor.exceeds_budget_at_fast());
  EXPECT_GE(life.governor.counts().late_at_fast, 95U);
  EXPECT_EQ(life.governor.typical_ms(), 11);
  Life spikes({.cost_ms = {2, 5, 12}, .load = [](std::uint64_t i) { return i % 50 == 7 ? 20.0 : 1.0; }}, Setting::fast);
  spikes.run(kHour);
  EXPECT_FALSE(spikes.governor.exceeds_budget_at_fast());
  EXPECT_EQ(spikes.governor.counts().late_at_fast, kHour / 50);
}

TEST(Governor, IsNeverRicherThanConfigured) {
  Life life({.cost_ms = {1, 2, 3}}, Setting::fast);
  life.run(1000);
  EXPECT_EQ(life.governor.setting(), Setting::fast);
  life.governor.restart(Setting::exact);
  EXPECT_EQ(life.governor.setting(), Setting::exact) << "what is asked for is tried at once";
  life.run(1000);
  EXPECT_EQ(life.governor.setting(), Setting::exact);
  life.governor.restart(Setting::balanced);
  EXPECT_EQ(life.governor.setting(), Setting::balanced);
}

TEST(Governor, ARestartWithTheSameRichestStaysWhereItIs) {
  Life life({.cost_ms = {2, 20, 50}});
  life.run(100);
  ASSERT_EQ(life.governor.setting(), Setting::fast);
  life.governor.restart(Setting::exact);
  EXPECT_EQ(life.governor.setting(), Setting::fast) << "the load is as it was";
}

TEST(Governor, OddDurationsDoNoHarm) {
  Governor governor(kBudget, Setting::exact);
  for (int i = 0; i < 5000; ++i) governor.record_duration(i % 3 == 0 ? 0 : i % 3 == 1 ? 1e-12 : 1e12);
  EXPECT_GE(static_cast<int>(governor.setting()), 1);
  EXPECT_LE(static_cast<int>(governor.setting()), 3);
}

}  // namespace
}  // namespace lightwell
