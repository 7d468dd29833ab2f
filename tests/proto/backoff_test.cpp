#include <gtest/gtest.h>

#include <lightwell/back_off.hpp>

namespace lightwell {
namespace {

TEST(Backoff, DoublesWithJitterUpToItsLimit) {
  Backoff back_off({100}, {1'000}, 1);
  for (const double middle : {100.0, 200.0, 400.0, 800.0, 1'000.0, 1'000.0}) {
    const auto pause = static_cast<double>(back_off.next().ns);
    EXPECT_GE(pause, 0.8 * middle - 1);
    EXPECT_LE(pause, 1.2 * middle);
  }
}

TEST(Backoff, StartsAgainAfterASuccess) {
  Backoff back_off({100}, {1'000}, 1);
  for (int i = 0; i < 5; ++i) (void)back_off.next();
  back_off.reset();
  EXPECT_LE(back_off.next().ns, 120);
}

TEST(Backoff, ClientsDoNotMarchInStep) {
  Backoff a({1'000'000}, {1'000'000}, 1), b({1'000'000}, {1'000'000}, 2'000'000);
  EXPECT_NE(a.next().ns, b.next().ns);
}

}  // namespace
}  // namespace lightwell
