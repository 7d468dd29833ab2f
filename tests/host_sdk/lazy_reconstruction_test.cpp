// Reconstructions that are computed when they are needed.
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/sample.hpp"

namespace lightwell::core {
namespace {

using Pointer = LazyReconstruction::Pointer;

/// Radiance that rings: a bright side and a dark one.
RadianceSh sky(float bright) {
  RadianceSh sh;
  sh.band = 4;
  for (std::size_t i = 0; i < 25; ++i) sh.c[i] = {bright / static_cast<float>(1 + i), 0.5F, 0.3F};
  return sh;
}

Pointer received(float bright) { return std::make_shared<const LazyReconstruction>(sky(bright)); }

RadianceReconstruction value_of(const LazyReconstruction& lazy) {
  const RadianceReconstruction* const ready = lazy.ready();
  return ready != nullptr ? *ready : lazy.compute();
}

void expect_equal(const RadianceReconstruction& a, const RadianceReconstruction& b) {
  EXPECT_EQ(a.sh, b.sh);
  EXPECT_EQ(a.blur, b.blur);
}

TEST(LazyReconstruction, IsComputedOnceAndKept) {
  const LazyReconstruction lazy(sky(3));
  EXPECT_FALSE(lazy.queried());
  EXPECT_EQ(lazy.ready(), nullptr);
  EXPECT_TRUE(lazy.queried());
  expect_equal(lazy.compute(), reconstruct(sky(3)));
  ASSERT_NE(lazy.ready(), nullptr);
  expect_equal(*lazy.ready(), reconstruct(sky(3)));
}

TEST(LazyReconstruction, DerivedOnesTransformTheReceived) {
  const Pointer a = received(2), b = received(5);
  const auto between = std::make_shared<const LazyReconstruction>(a, b, 0.25F);
  const Quat q = Quat::about({0, 1, 0}, 0.4), p = Quat::about({1, 0, 0}, 1.1);
  const auto once = std::make_shared<const LazyReconstruction>(between, q);
  const LazyReconstruction twice(once, p);
  const RadianceReconstruction expected = interpolated(reconstruct(sky(2)), reconstruct(sky(5)), 0.25F);
  expect_equal(value_of(twice), rotated(expected, p * q));
  expect_equal(value_of(*once), rotated(expected, q));
  expect_equal(value_of(*between), expected);
  EXPECT_TRUE(a->queried());
  EXPECT_TRUE(b->queried());
}

TEST(LazyReconstruction, RotationsOfRotationsHoldTheReceivedAlone) {
  const Pointer root = received(2);
  std::weak_ptr<const LazyReconstruction> first;
  Pointer turned = root;
  for (int i = 0; i < 1000; ++i) {
    turned = std::make_shared<const LazyReconstruction>(turned, Quat::about({0, 1, 0}, 0.01));
    if (i == 0) first = turned;
  }
  EXPECT_TRUE(first.expired());
  EXPECT_EQ(root.use_count(), 2);
}

TEST(LazyReconstruction, FirstQueriesOfManyThreadsAgree) {
  const Pointer a = received(2);
  const LazyReconstruction lazy(a, Quat::about({0, 1, 0}, 0.4));
  const RadianceReconstruction expected = rotated(reconstruct(sky(2)), Quat::about({0, 1, 0}, 0.4));
  std::vector<RadianceReconstruction> values(8);
  std::vector<std::thread> threads;
  for (RadianceReconstruction& value : values) threads.emplace_back([&] { value = value_of(lazy); });
  for (std::thread& t : threads) t.join();
  for (const RadianceReconstruction& value : values) expect_equal(value, expected);
}

/// Whether the reader thread computed the newest. `queried`: whether a query came for the one before.
bool computes(ReconstructAhead& ahead, bool queried) {
  const LazyReconstruction before(sky(2)), newest(sky(3));
  if (queried) (void)before.ready();
  ahead.published(&before, &newest);
  return newest.ready() != nullptr;
}

TEST(ReconstructAhead, ComputesForWhoQueriesRadianceAlone) {
  ReconstructAhead ahead;
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(computes(ahead, false));
  EXPECT_TRUE(computes(ahead, true));
  for (unsigned i = 1; i < ReconstructAhead::kMaxWithoutQuery; ++i) EXPECT_TRUE(computes(ahead, false)) << i;
  EXPECT_FALSE(computes(ahead, false));
}

TEST(ReconstructAhead, ADescriptorWithAMapHasNone) {
  ReconstructAhead ahead;
  ahead.published(nullptr, nullptr);
  EXPECT_TRUE(computes(ahead, true));
  ahead.published(nullptr, nullptr);
}

}  // namespace
}  // namespace lightwell::core
