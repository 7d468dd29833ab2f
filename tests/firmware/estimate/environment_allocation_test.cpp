// Maps, whole or as changes, from the sums to the encoded bytes, allocate no memory.
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/geometry.hpp>

#include "estimate/common/environment_updates.hpp"
#include "support/allocation_counter.hpp"

namespace lightwell::estimate {
namespace {

TEST(EnvironmentAllocation, NothingIsAllocatedAfterConstruction) {
  constexpr int kCells = 4000;
  std::vector<Vec3f> direction;
  for (int i = 0; i < kCells; ++i) direction.push_back(vec_cast<float>(fibonacci_direction(i, kCells)));
  const std::vector<float> solid_angle(kCells, static_cast<float>(4 * std::numbers::pi / kCells));
  for (const int edge : {8, 64}) {
    EnvironmentMapper mapper(direction, solid_angle, edge, {.rate_hz = 20});
    Encoder encoder;
    Descriptor d;
    std::vector<CellSum> sums(kCells, {1, 1, 1});
    // The encoder's first message allocates.
    ASSERT_TRUE(encoder.encode(d).ok());
    int whole = 0, changes = 0, none = 0;
    test::AllocationCount count;
    for (int frame = 0; frame < 200; ++frame) {
      for (std::size_t c = 0; c < sums.size(); c += 7)
        sums[c].g = 1 + 0.02F * static_cast<float>((static_cast<std::size_t>(frame) + c) % 5);
      const double factor = frame < 100 ? 1 : 2;
      mapper.update(sums, {}, {}, factor, {frame * std::int64_t{33'333'333}}, d.environment);
      ++(d.environment ? d.environment->whole() ? whole : changes : none);
      if (!encoder.encode(d).ok()) break;
    }
    EXPECT_EQ(count.value(), 0U);
    if (count.value() != 0) test::AllocationCount::print_first();
    EXPECT_GT(whole, 3);
    EXPECT_GT(changes, 3);
    EXPECT_GT(none, 3);
  }
}

TEST(EnvironmentMapper, SendsAWholeMapAtOnceWhenTheScaleChanges) {
  const std::vector<Vec3f> direction = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  const std::vector<float> solid_angle(6, static_cast<float>(4 * std::numbers::pi / 6));
  EnvironmentMapper mapper(direction, solid_angle, 8, {.rate_hz = 1});
  const std::vector<CellSum> sums(6, {1, 1, 1});
  std::optional<EnvironmentMap> out;
  mapper.update(sums, {}, {}, 1, {0}, out);
  ASSERT_TRUE(out && out->whole());
  const float before = environment_radiance(*out, {1, 1, 1}, 1).r;
  mapper.update(sums, {}, {}, 1, {1'000'000}, out);
  EXPECT_FALSE(out);
  mapper.update(sums, {}, {}, 3, {2'000'000}, out);
  ASSERT_TRUE(out && out->whole());
  EXPECT_NEAR(environment_radiance(*out, {1, 1, 1}, 1).r / before, 3, 0.02);
}

}  // namespace
}  // namespace lightwell::estimate
