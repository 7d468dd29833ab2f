// RoughnessSearch: evaluations until the misfit is that expected, from any start.
#include "estimate/specular/roughness_search.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace lightwell::specular {
namespace {

/// Evaluations until the search is done, for a misfit that reaches the expected one at `truth`.
int evaluations(RoughnessSearch search, double truth) {
  int out = 0;
  for (; !search.done() && out < 100; ++out) {
    EXPECT_GE(search.alpha(), RoughnessSearch::kMinAlpha * 0.999);
    EXPECT_LE(search.alpha(), RoughnessSearch::kMaxAlpha * 1.001);
    search.add(search.alpha() / truth);
  }
  EXPECT_TRUE(search.done());
  // The middle of its cell, or of the first or last one where it is outside of the range.
  const double width = std::log(RoughnessSearch::kMaxAlpha / RoughnessSearch::kMinAlpha) / RoughnessSearch::kCells;
  const double inside = std::clamp(truth, RoughnessSearch::kMinAlpha, RoughnessSearch::kMaxAlpha);
  EXPECT_LE(std::abs(std::log(search.alpha() / inside)), 0.501 * width) << truth;
  return out;
}

TEST(RoughnessSearch, FindsTheRootFromAnyStart) {
  for (const double truth : {0.001, 0.0201, 0.0213, 0.03, 0.1001, 0.25, 0.487, 0.499, 3.0}) {
    EXPECT_EQ(evaluations(RoughnessSearch(), truth), 6);
    for (const double start : {0.001, 0.02, 0.0205, 0.05, 0.1, 0.2, 0.49, 0.5, 1.0})
      // Out and back, at most twice the logarithm of 64 cells.
      EXPECT_LE(evaluations(RoughnessSearch(start), truth), 12) << start << " to " << truth;
    EXPECT_LE(evaluations(RoughnessSearch(std::clamp(truth, 0.02, 0.5)), truth), 2);
  }
}

}  // namespace
}  // namespace lightwell::specular
