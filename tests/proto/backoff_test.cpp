#include <gtest/gtest.h>

#include <lightwell/backoff.hpp>

namespace lightwell {
namespace {

TEST(Backoff, DoublesWithJitterUpToItsLimit) {
  Backoff backoff({100}, {1'000}, 1);
  for (const double middle : {100.0, 200.0, 400.0, 800.0, 1'000.0, 1'000.0}) {
    const auto pause = static_cast<double>(backoff.next().ns);
    EXPECT_GE(pause, 0.8 * middle - 1);
    EXPECT_LE(pause, 1.2 * middle);
  }
}

TEST(Backoff, RestartsAfterASuccess) {
  Backoff backoff({100}, {1'000}, 1);
  for (int i = 0; i < 5; ++i) (void)backoff.next();
  backoff.reset();
  EXPECT_LE(backoff.next().ns, 120);
}

TEST(Backoff, ClientsAreNotSynchronized) {
  Backoff a({1'000'000}, {1'000'000}, 1), b({1'000'000}, {1'000'000}, 2'000'000);
  EXPECT_NE(a.next().ns, b.next().ns);
}

}  // namespace
}  // namespace lightwell
