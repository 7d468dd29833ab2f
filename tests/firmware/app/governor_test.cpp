// Simulations of a Governor: durations by setting, or bounds by point, load of the machine and noise over up to hours
// of estimates.
#include "app/governor.hpp"

#include <algorithm>
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
  std::array<double, kSettings.size()> cost_ms{0.5, 2, 5, 12};  ///< fastest, fast, balanced, exact
  double noise = 0;
  std::function<double(std::uint64_t)> load = [](std::uint64_t) { return 1.0; };
};

struct Simulation {
  explicit Simulation(Machine m, Setting richest = Setting::exact, double budget = kBudget)
      : machine(std::move(m)), governor(Governed::duration, budget, richest) {}

  void run(std::uint64_t estimates) {
    for (std::uint64_t i = 0; i < estimates; ++i, ++at) {
      const Setting setting = governor.point().setting;
      const auto s = static_cast<std::size_t>(std::ranges::find(kSettings, setting) - kSettings.begin());
      double ms = machine.cost_ms[s] * machine.load(at);
      if (machine.noise > 0) ms *= std::exp(machine.noise * normal(random));
      ++spent[s];
      late += ms > kBudget ? 1 : 0;
      governor.record(ms);
    }
  }
  [[nodiscard]] std::uint64_t moves() const { return governor.counts().moves; }

  Machine machine;
  Governor governor;
  std::mt19937_64 random{20240607};
  std::normal_distribution<double> normal;
  std::uint64_t at = 0, late = 0;
  std::array<std::uint64_t, kSettings.size()> spent{};  ///< Estimates by setting, as cost_ms.
};

TEST(Governor, WithoutABudgetTheSettingNeverChanges) {
  Simulation simulation({.cost_ms = {1e2, 1e3, 1e4, 1e5}}, Setting::exact, 0);
  simulation.run(1000);
  EXPECT_EQ(simulation.governor.point().setting, Setting::exact);
  EXPECT_EQ(simulation.governor.counts().exceeded, 0U);
}

TEST(Governor, StaysAtTheConfiguredSettingWithinTheBudget) {
  for (const Setting richest : kSettings) {
    Simulation simulation({.cost_ms = {0.5, 1, 2, 4}, .noise = 0.1}, richest);
    simulation.run(kHour);
    EXPECT_EQ(simulation.governor.point().setting, richest);
    EXPECT_EQ(simulation.moves(), 0U);
  }
}

TEST(Governor, LowersAtOnceIfFarOverTheBudget) {
  Simulation simulation({.cost_ms = {2, 7, 9, 16}});
  simulation.run(2);
  EXPECT_EQ(simulation.governor.point().setting, Setting::balanced);
  Simulation far_over({.cost_ms = {2, 8, 12, 30}});
  far_over.run(2);
  EXPECT_EQ(far_over.governor.point().setting, Setting::fastest) << "skips those that are predicted not to fit either";
  far_over.run(100);
  EXPECT_EQ(far_over.governor.point().setting, Setting::fast) << "which fits";
}

TEST(Governor, LowersWithinAFewFramesIfSlightlyOverTheBudget) {
  Simulation simulation({.cost_ms = {0.5, 2, 5, 11}});
  simulation.run(3);
  EXPECT_EQ(simulation.governor.point().setting, Setting::balanced);
}

TEST(Governor, FollowsATemporaryLoad) {
  // Twice the load from second 20 to second 80.
  Simulation simulation({.cost_ms = {1, 4, 6, 9},
                         .noise = 0.02,
                         .load = [](std::uint64_t i) { return i >= 20 * kSecond && i < 80 * kSecond ? 2.0 : 1.0; }},
                        Setting::balanced);
  simulation.run(20 * kSecond);
  EXPECT_EQ(simulation.governor.point().setting, Setting::balanced);
  simulation.run(4);
  EXPECT_EQ(simulation.governor.point().setting, Setting::fastest) << "fast is predicted to take more than 9 ms";
  simulation.run(60 * kSecond - 4);
  EXPECT_EQ(simulation.governor.point().setting, Setting::fast) << "which takes 8 ms";
  EXPECT_LE(simulation.late, 4U) << "only those needed for detection";
  simulation.run(4 * kSecond);
  EXPECT_EQ(simulation.governor.point().setting, Setting::balanced) << "the richer setting fits again";
  EXPECT_EQ(simulation.moves(), 3U);
}

TEST(Governor, SettlesOnTheRichestThatFits) {
  Simulation simulation({.noise = 0.05});
  simulation.run(60 * kSecond);
  EXPECT_EQ(simulation.governor.point().setting, Setting::balanced);
  EXPECT_GT(simulation.spent[2], 55 * kSecond);
}

TEST(Governor, RarelyMovesIfTheNextSettingDoesNotFit) {
  for (const double noise : {0.0, 0.05, 0.2}) {
    for (const double richer : {10.2, 12.0, 15.0, 25.0}) {
      Simulation simulation({.cost_ms = {1.5, 6, richer, 4 * richer}, .noise = noise}, Setting::balanced);
      simulation.run(kHour);
      EXPECT_LE(simulation.moves(), 8U) << "noise " << noise << ", balanced takes " << richer;
      EXPECT_LT(simulation.late, kHour / 50) << "noise " << noise << ", balanced takes " << richer;
    }
  }
}

TEST(Governor, DoesNotOscillateIfTheRicherSettingBarelyFits) {
  for (const double richer : {6.5, 7.0, 7.5, 8.0, 8.5, 9.0, 9.5, 9.9}) {
    for (const double noise : {0.02, 0.08, 0.15, 0.2, 0.25}) {
      Simulation simulation({.cost_ms = {0.6, 3, richer, 30}, .noise = noise}, Setting::balanced);
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
  EXPECT_EQ(simulation.late, simulation.governor.counts().exceeded);
}

TEST(Governor, ToleratesRandomSpikes) {
  std::mt19937_64 dice(5);
  Simulation simulation({.noise = 0.1, .load = [&](std::uint64_t) { return dice() % 200 == 0 ? 5.0 : 1.0; }},
                        Setting::balanced);
  simulation.run(kHour);
  EXPECT_GT(simulation.spent[2], kHour * 98 / 100);
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
  EXPECT_EQ(simulation.governor.point().setting, Setting::balanced);
}

TEST(Governor, RetriesAFailedRaiseAfterTheCauseIsGone) {
  Simulation simulation({.cost_ms = {0.6, 3, 14, 40}}, Setting::balanced);
  simulation.run(10 * 60 * kSecond);
  EXPECT_EQ(simulation.governor.point().setting, Setting::fast);
  simulation.machine.cost_ms = {0.6, 3, 6, 40};  // Another scene, in which the richer setting costs less.
  simulation.run(kHour);
  EXPECT_EQ(simulation.governor.point().setting, Setting::balanced);
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
    EXPECT_GT(simulation.spent[2] + simulation.spent[3], kHour / 3)
        << "seed " << seed << ": richer settings are used when they fit";
  }
}

TEST(Governor, ReportsIfEvenFastestIsLate) {
  Simulation simulation({.cost_ms = {11, 15, 20, 40}});
  simulation.run(100);
  EXPECT_EQ(simulation.governor.point().setting, Setting::fastest);
  EXPECT_TRUE(simulation.governor.exceeds_everywhere());
  EXPECT_GE(simulation.governor.counts().exceeded_first, 95U);
  EXPECT_EQ(simulation.governor.typical(), 11);
  Simulation spikes({.cost_ms = {2, 4, 5, 12}, .load = [](std::uint64_t i) { return i % 50 == 7 ? 20.0 : 1.0; }},
                    Setting::fastest);
  spikes.run(kHour);
  EXPECT_FALSE(spikes.governor.exceeds_everywhere());
  EXPECT_EQ(spikes.governor.counts().exceeded_first, kHour / 50);
}

TEST(Governor, IsNeverRicherThanConfigured) {
  Simulation simulation({.cost_ms = {0.5, 1, 2, 3}}, Setting::fast);
  simulation.run(1000);
  EXPECT_EQ(simulation.governor.point().setting, Setting::fast);
  simulation.governor.restart(Setting::exact);
  EXPECT_EQ(simulation.governor.point().setting, Setting::exact) << "a newly configured setting is used at once";
  simulation.run(1000);
  EXPECT_EQ(simulation.governor.point().setting, Setting::exact);
  simulation.governor.restart(Setting::balanced);
  EXPECT_EQ(simulation.governor.point().setting, Setting::balanced);
}

TEST(Governor, RestartWithTheSameMaximumKeepsTheSetting) {
  Simulation simulation({.cost_ms = {0.5, 2, 20, 50}});
  simulation.run(100);
  ASSERT_EQ(simulation.governor.point().setting, Setting::fast);
  simulation.governor.restart(Setting::exact);
  EXPECT_EQ(simulation.governor.point().setting, Setting::fast) << "the load is unchanged";
}

TEST(Governor, SurvivesExtremeDurations) {
  Governor governor(Governed::duration, kBudget, Setting::exact);
  for (int i = 0; i < 5000; ++i) governor.record(i % 3 == 0 ? 0 : i % 3 == 1 ? 1e-12 : 1e12);
  EXPECT_GE(static_cast<int>(governor.point().setting), 1);
  EXPECT_LE(static_cast<int>(governor.point().setting), 4);
}

/// Bounds of a scene at the points of a governor of bounds: bound * exp(noise * N(0, 1)).
struct Scene {
  double exact, exact_interleaved, balanced_interleaved, fastest;
  double noise = 0;
  [[nodiscard]] double bound_at(const OperatingPoint& point) const {
    if (point.interleave == 0) return point.setting == Setting::fastest ? fastest : exact;
    return point.setting == Setting::exact ? exact_interleaved : balanced_interleaved;
  }
};

struct BoundSimulation {
  void run(const Scene& scene, std::uint64_t estimates) {
    for (std::uint64_t i = 0; i < estimates; ++i) {
      const double bound = scene.bound_at(governor.point()) * std::exp(scene.noise * normal(random));
      exceeded += bound > kLimit ? 1 : 0;
      governor.record(bound);
    }
  }

  static constexpr double kLimit = 0.02;
  static constexpr OperatingPoint kFastest{Setting::fastest}, kExact{Setting::exact},
      kBalancedInterleaved{Setting::balanced, 16}, kExactInterleaved{Setting::exact, 16};
  Governor governor{Governed::bound, kLimit, Setting::exact};
  std::mt19937_64 random{7};
  std::normal_distribution<double> normal;
  std::uint64_t exceeded = 0;
};

TEST(BoundGovernor, TakesTheCheapestPointWhoseBoundHolds) {
  const struct {
    Scene scene;
    OperatingPoint cheapest;
  } cases[] = {{{0.004, 0.004, 0.008, 0.015, 0.05}, BoundSimulation::kFastest},
               {{0.005, 0.005, 0.014, 0.025, 0.05}, BoundSimulation::kBalancedInterleaved},
               {{0.012, 0.0125, 0.022, 0.03, 0.05}, BoundSimulation::kExactInterleaved},
               {{0.012, 0.03, 0.04, 0.05, 0.05}, BoundSimulation::kExact}};
  for (const auto& c : cases) {
    BoundSimulation simulation;
    simulation.run(c.scene, 60 * kSecond);
    EXPECT_EQ(simulation.governor.point(), c.cheapest) << c.scene.fastest;
    EXPECT_LE(simulation.exceeded, 8U) << c.scene.fastest;
  }
}

TEST(BoundGovernor, StepsBackWhereASceneNeedsItAndOnAgain) {
  BoundSimulation simulation;
  const Scene plain{0.003, 0.003, 0.007, 0.012, 0.05}, contrast{0.006, 0.006, 0.016, 0.026, 0.05};
  simulation.run(plain, 60 * kSecond);
  EXPECT_EQ(simulation.governor.point(), BoundSimulation::kFastest);
  simulation.run(contrast, 3);
  EXPECT_EQ(simulation.governor.point(), BoundSimulation::kBalancedInterleaved) << "within three estimates";
  simulation.run(contrast, 60 * kSecond);
  EXPECT_EQ(simulation.governor.point(), BoundSimulation::kBalancedInterleaved);
  simulation.run(plain, 10 * kSecond);
  EXPECT_EQ(simulation.governor.point(), BoundSimulation::kFastest);
  EXPECT_LE(simulation.governor.counts().moves, 4U);
  EXPECT_LE(simulation.exceeded, 8U);
}

TEST(BoundGovernor, DoesNotOscillate) {
  for (const double fastest : {0.015, 0.018, 0.0195, 0.021, 0.023, 0.03}) {
    for (const double noise : {0.0, 0.02, 0.1}) {
      BoundSimulation simulation;
      simulation.run({0.005, 0.005, 0.012, fastest, noise}, kHour);
      EXPECT_LE(simulation.governor.counts().moves, 16U) << fastest << ", noise " << noise;
      EXPECT_LT(static_cast<double>(simulation.exceeded), 0.06 * static_cast<double>(kHour)) << fastest;
    }
  }
}

TEST(BoundGovernor, IgnoresFlaggedFramesAndSaysWhereNoPointHolds) {
  BoundSimulation simulation;
  const Scene dark{INFINITY, INFINITY, INFINITY, INFINITY};
  simulation.run(dark, kSecond);
  EXPECT_EQ(simulation.governor.point(), BoundSimulation::kFastest);
  EXPECT_EQ(simulation.governor.counts().moves, 0U);
  simulation.run({0.05, 0.05, 0.05, 0.05}, kSecond);
  EXPECT_EQ(simulation.governor.point(), BoundSimulation::kExact);
  EXPECT_TRUE(simulation.governor.exceeds_everywhere());
}

TEST(BoundGovernor, IsNeverRicherThanConfigured) {
  for (const Setting richest : kSettings) {
    Governor governor(Governed::bound, 0.01, richest);
    EXPECT_EQ(governor.point().setting, Setting::fastest);
    for (int i = 0; i < 100; ++i) governor.record(0.5);
    EXPECT_EQ(governor.point(), OperatingPoint{richest});
  }
}

TEST(OperatingPoint, InterleavedFramesAreCheaperThanWholeOnes) {
  constexpr OperatingPoint kAscending[] = {{Setting::fastest}, {Setting::balanced, 16}, {Setting::exact, 16},
                                           {Setting::fast},    {Setting::balanced},     {Setting::exact}};
  for (std::size_t i = 0; i < std::size(kAscending); ++i)
    for (std::size_t j = 0; j < std::size(kAscending); ++j)
      EXPECT_EQ(is_cheaper(kAscending[i], kAscending[j]), i < j) << i << " " << j;
}

}  // namespace
}  // namespace lightwell
