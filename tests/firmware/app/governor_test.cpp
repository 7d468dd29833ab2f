// Simulations of a Governor: durations by setting, load of the machine and noise over up to hours of estimates.
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

/// Duration of an estimate: cost * load * exp(noise * N(0, 1)), ms.
struct Machine {
  std::array<double, 3> cost_ms{2, 5, 12};  ///< fast, balanced, exact
  double noise = 0;
  std::function<double(std::uint64_t)> load = [](std::uint64_t) { return 1.0; };
};

struct Simulation {
  explicit Simulation(Machine m, Setting richest = Setting::exact, double budget = kBudget)
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

TEST(Governor, WithoutABudgetTheSettingNeverChanges) {
  Simulation simulation({.cost_ms = {1e3, 1e4, 1e5}}, Setting::exact, 0);
  simulation.run(1000);
  EXPECT_EQ(simulation.governor.setting(), Setting::exact);
  EXPECT_EQ(simulation.governor.counts().late, 0U);
}

TEST(Governor, StaysAtTheConfiguredSettingWithinTheBudget) {
  for (const Setting richest : kSettings) {
    Simulation simulation({.cost_ms = {1, 2, 4}, .noise = 0.1}, richest);
    simulation.run(kHour);
    EXPECT_EQ(simulation.governor.setting(), richest);
    EXPECT_EQ(simulation.moves(), 0U);
  }
}

TEST(Governor, LowersAtOnceIfFarOverTheBudget) {
  Simulation simulation({.cost_ms = {7, 9, 16}});
  simulation.run(2);
  EXPECT_EQ(simulation.governor.setting(), Setting::balanced);
  Simulation far_over({.cost_ms = {8, 12, 30}});
  far_over.run(2);
  EXPECT_EQ(far_over.governor.setting(), Setting::fast) << "skips the setting between, which would not fit either";
}

TEST(Governor, LowersWithinAFewFramesIfSlightlyOverTheBudget) {
  Simulation simulation({.cost_ms = {2, 5, 11}});
  simulation.run(3);
  EXPECT_EQ(simulation.governor.setting(), Setting::balanced);
}

TEST(Governor, FollowsATemporaryLoad) {
  // Twice the load from second 20 to second 80.
  Simulation simulation({.cost_ms = {4, 6, 9},
                         .noise = 0.02,
                         .load = [](std::uint64_t i) { return i >= 20 * kSecond && i < 80 * kSecond ? 2.0 : 1.0; }},
                        Setting::balanced);
  simulation.run(20 * kSecond);
  EXPECT_EQ(simulation.governor.setting(), Setting::balanced);
  simulation.run(4);
  EXPECT_EQ(simulation.governor.setting(), Setting::fast);
  simulation.run(60 * kSecond - 4);
  EXPECT_EQ(simulation.governor.setting(), Setting::fast);
  EXPECT_LE(simulation.late, 4U) << "only those needed for detection";
  simulation.run(4 * kSecond);
  EXPECT_EQ(simulation.governor.setting(), Setting::balanced) << "the richer setting fits again";
  EXPECT_EQ(simulation.moves(), 2U);
}

TEST(Governor, SettlesOnTheRichestThatFits) {
  Simulation simulation({.noise = 0.05});
  simulation.run(60 * kSecond);
  EXPECT_EQ(simulation.governor.setting(), Setting::balanced);
  EXPECT_GT(simulation.spent[1], 55 * kSecond);
}

TEST(Governor, RarelyMovesIfTheNextSettingDoesNotFit) {
  for (const double noise : {0.0, 0.05, 0.2}) {
    for (const double richer : {10.2, 12.0, 15.0, 25.0}) {
      Simulation simulation({.cost_ms = {6, richer, 4 * richer}, .noise = noise}, Setting::balanced);
      simulation.run(kHour);
      EXPECT_LE(simulation.moves(), 7U) << "noise " << noise << ", balanced takes " << richer;
      EXPECT_LT(simulation.late, kHour / 50) << "noise " << noise << ", balanced takes " << richer;
    }
  }
}

TEST(Governor, DoesNotOscillateIfTheRicherSettingBarelyFits) {
  for (const double richer : {6.5, 7.0, 7.5, 8.0, 8.5, 9.0, 9.5, 9.9}) {
    for (const double noise : {0.02, 0.08, 0.15, 0.2, 0.25}) {
      Simulation simulation({.cost_ms = {3, richer, 30}, .noise = noise}, Setting::balanced);
      simulation.run(kHour);
      EXPECT_LE(simulation.moves(), 16U) << "the back-off grows by powers of two: " << richer << " ms, noise " << noise;
      EXPECT_LT(static_cast<double>(simulation.late), 0.06 * static_cast<double>(kHour))
          << richer << " ms, noise " << noise;
    }
  }
}

TEST(Governor, IgnoresNoiseAndSingleSpikes) {
  Simulation simulation({.noise = 0.1, .load = [](std::uint64_t i) { return i % 97 == 50 ? 8.0 : 1.0; }},
                        Setting::balanced);
  simulation.run(kHour);
  EXPECT_EQ(simulation.moves(), 0U);
  EXPECT_EQ(simulation.late, simulation.governor.counts().late);
}

TEST(Governor, ToleratesRandomSpikes) {
  std::mt19937_64 dice(5);
  Simulation simulation({.noise = 0.1, .load = [&](std::uint64_t) { return dice() % 200 == 0 ? 5.0 : 1.0; }},
                        Setting::balanced);
  simulation.run(kHour);
  EXPECT_GT(simulation.spent[1], kHour * 98 / 100);
  EXPECT_LE(simulation.moves(), 20U) << "two late estimates in succession are rare";
}

TEST(Governor, DoesNotFollowAPeriodicLoadForever) {
  // Two seconds with load, three without: too short for a lasting raise.
  Simulation simulation(
      {.noise = 0.05, .load = [](std::uint64_t i) { return i % (5 * kSecond) < 2 * kSecond ? 3.0 : 1.0; }},
      Setting::balanced);
  simulation.run(kHour);
  EXPECT_LE(simulation.moves(), 8U);
  EXPECT_LT(simulation.late, 50U);
  // Then the load ends permanently.
  simulation.machine.load = [](std::uint64_t) { return 1.0; };
  simulation.run(10 * 60 * kSecond);
  EXPECT_EQ(simulation.governor.setting(), Setting::balanced);
}

TEST(Governor, RetriesAFailedRaiseAfterTheCauseIsGone) {
  Simulation simulation({.cost_ms = {3, 14, 40}}, Setting::balanced);
  simulation.run(10 * 60 * kSecond);
  EXPECT_EQ(simulation.governor.setting(), Setting::fast);
  simulation.machine.cost_ms = {3, 6, 40};  // Another scene, in which the richer setting costs less.
  simulation.run(kHour);
  EXPECT_EQ(simulation.governor.setting(), Setting::balanced);
}

TEST(Governor, FewEstimatesAreLateUnderRandomLoads) {
  // A different load every 3 to 120 seconds, between half and four times the nominal one.
  for (unsigned seed = 1; seed <= 8; ++seed) {
    std::mt19937_64 random(seed);
    double load = 1;
    std::uint64_t until = 0, changes = 0;
    Simulation simulation({.noise = 0.08, .load = [&](std::uint64_t i) {
                             if (i >= until) {
                               load = std::exp2(std::uniform_real_distribution<double>(-1, 2)(random));
                               until =
                                   i + std::uniform_int_distribution<std::uint64_t>(3 * kSecond, 120 * kSecond)(random);
                               ++changes;
                             }
                             return load;
                           }});
    simulation.run(kHour);
    EXPECT_LT(static_cast<double>(simulation.late), 0.01 * static_cast<double>(kHour)) << "seed " << seed;
    EXPECT_LE(simulation.moves(), 3 * changes) << "seed " << seed;
    EXPECT_GT(simulation.spent[1] + simulation.spent[2], kHour / 3)
        << "seed " << seed << ": richer settings are used when they fit";
  }
}

TEST(Governor, ReportsIfEvenFastIsLate) {
  Simulation simulation({.cost_ms = {11, 20, 40}});
  simulation.run(100);
  EXPECT_EQ(simulation.governor.setting(), Setting::fast);
  EXPECT_TRUE(simulation.governor.exceeds_budget_at_fast());
  EXPECT_GE(simulation.governor.counts().late_at_fast, 95U);
  EXPECT_EQ(simulation.governor.typical_ms(), 11);
  Simulation spikes({.cost_ms = {2, 5, 12}, .load = [](std::uint64_t i) { return i % 50 == 7 ? 20.0 : 1.0; }},
                    Setting::fast);
  spikes.run(kHour);
  EXPECT_FALSE(spikes.governor.exceeds_budget_at_fast());
  EXPECT_EQ(spikes.governor.counts().late_at_fast, kHour / 50);
}

TEST(Governor, IsNeverRicherThanConfigured) {
  Simulation simulation({.cost_ms = {1, 2, 3}}, Setting::fast);
  simulation.run(1000);
  EXPECT_EQ(simulation.governor.setting(), Setting::fast);
  simulation.governor.restart(Setting::exact);
  EXPECT_EQ(simulation.governor.setting(), Setting::exact) << "a newly configured setting is used at once";
  simulation.run(1000);
  EXPECT_EQ(simulation.governor.setting(), Setting::exact);
  simulation.governor.restart(Setting::balanced);
  EXPECT_EQ(simulation.governor.setting(), Setting::balanced);
}

TEST(Governor, RestartWithTheSameMaximumKeepsTheSetting) {
  Simulation simulation({.cost_ms = {2, 20, 50}});
  simulation.run(100);
  ASSERT_EQ(simulation.governor.setting(), Setting::fast);
  simulation.governor.restart(Setting::exact);
  EXPECT_EQ(simulation.governor.setting(), Setting::fast) << "the load is unchanged";
}

TEST(Governor, SurvivesExtremeDurations) {
  Governor governor(kBudget, Setting::exact);
  for (int i = 0; i < 5000; ++i) governor.record_duration(i % 3 == 0 ? 0 : i % 3 == 1 ? 1e-12 : 1e12);
  EXPECT_GE(static_cast<int>(governor.setting()), 1);
  EXPECT_LE(static_cast<int>(governor.setting()), 3);
}

}  // namespace
}  // namespace lightwell
