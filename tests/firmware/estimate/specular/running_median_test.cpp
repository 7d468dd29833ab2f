// Streaming medians against those of all values.
#include "estimate/specular/running_median.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/quantile.hpp>

namespace lightwell::specular {
namespace {

TEST(RunningMedian, OfOneValueIsIt) {
  RunningMedian m;
  EXPECT_TRUE(m.empty());
  m.add(1, 2, 3);
  EXPECT_EQ(m.value()[0], 1);
  EXPECT_EQ(m.value()[2], 3);
}

TEST(RunningMedian, OfEqualValuesIsExact) {
  RunningMedian m;
  for (int k = 0; k < 1'000'000; ++k) m.add(0.25F, 0, 1e20F);
  EXPECT_EQ(m.value()[0], 0.25F);
  EXPECT_EQ(m.value()[1], 0);
  EXPECT_EQ(m.value()[2], 1e20F);
}

TEST(RunningMedian, IsNearTheMedianOfAllValues) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal(1, 0.1F);
  std::uniform_real_distribution<float> uniform(0, 1);
  double squares = 0;
  constexpr int kStreams = 200, kValues = 250;
  for (int stream = 0; stream < kStreams; ++stream) {
    RunningMedian m;
    std::vector<float> values;
    for (int k = 0; k < kValues; ++k) {
      // A fifth are highlights.
      const float v = uniform(random) < 0.2F ? 1.2F + uniform(random) : normal(random);
      values.push_back(v);
      m.add(v, v, v);
    }
    squares += std::pow(static_cast<double>(m.value()[1]) - median(values), 2);
  }
  // The median of 250 values is itself known to 1.25 sigma / sqrt(250), 0.008; the approximation adds four times that.
  EXPECT_LT(std::sqrt(squares / kStreams), 0.035);
}

TEST(RunningMedian, ReachesANewLevelWithinItsMemory) {
  RunningMedian m;
  std::mt19937 random(6);
  std::normal_distribution<float> normal(0, 0.02F);
  const auto add = [&](float level) {
    const float v = level + normal(random);
    m.add(v, v, v);
  };
  for (int k = 0; k < 500; ++k) add(1);
  for (std::uint32_t k = 0; k < 4 * RunningMedian::kMemory; ++k) add(0.5F);
  EXPECT_NEAR(m.value()[0], 0.5, 0.03);
}

}  // namespace
}  // namespace lightwell::specular
