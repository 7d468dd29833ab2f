#include "bench/vector_unit.hpp"

#include <gtest/gtest.h>
#include <hwy/highway.h>
#include <hwy/targets.h>

namespace lightwell::bench {
namespace {

/// Restores all targets, because other tests share the process.
struct VectorUnit : testing::Test {
  ~VectorUnit() override { hwy::DisableTargets(0); }
};

void expect_limited(const char* name, std::int64_t target) {
  hwy::DisableTargets(0);
  const std::int64_t before = hwy::SupportedTargets();
  const Result<std::string> selected = select_vector_unit(name);
  if ((before & target) == 0) {
    EXPECT_FALSE(selected);
    EXPECT_EQ(hwy::SupportedTargets(), before);
    return;
  }
  ASSERT_TRUE(selected) << selected.status().message();
  EXPECT_EQ(*selected, hwy::TargetName(target));
  EXPECT_EQ(hwy::SupportedTargets() & (target - 1), 0) << "a better target is still enabled";
  EXPECT_NE(hwy::SupportedTargets() & target, 0);
}

/// The kernels that HWY_DYNAMIC_DISPATCH calls: the position of the target among those that were compiled.
std::size_t dispatched(const char* name) {
  EXPECT_TRUE(select_vector_unit(name));
  return hwy::GetChosenTarget().GetIndex();
}

TEST_F(VectorUnit, KernelsOfTheSelectedTargetAreCalled) {
  if ((hwy::SupportedTargets() & HWY_SSE4) == 0) GTEST_SKIP() << "not an x86 processor";
  const std::size_t sse4 = dispatched("sse4");
  hwy::GetChosenTarget().Update(HWY_SSE4);
  EXPECT_EQ(sse4, hwy::GetChosenTarget().GetIndex());
  if ((hwy::SupportedTargets() & HWY_AVX2) == 0) return;
  EXPECT_NE(dispatched("best"), sse4);
}

TEST_F(VectorUnit, LimitsTheTargets) {
  expect_limited("avx2", HWY_AVX2);
  expect_limited("sse4", HWY_SSE4);
}

TEST_F(VectorUnit, BestEnablesAllTargetsOfTheProcessor) {
  const std::int64_t before = hwy::SupportedTargets();
  (void)select_vector_unit("sse4");
  const Result<std::string> best = select_vector_unit("best");
  ASSERT_TRUE(best) << best.status().message();
  EXPECT_EQ(*best, hwy::TargetName(hwy::SupportedAndGeneratedTargets().front()));
  EXPECT_EQ(hwy::SupportedTargets(), before);
}

TEST_F(VectorUnit, AnUnknownNameIsRejected) {
  EXPECT_FALSE(select_vector_unit("mmx"));
  EXPECT_FALSE(select_vector_unit(""));
}

}  // namespace
}  // namespace lightwell::bench
