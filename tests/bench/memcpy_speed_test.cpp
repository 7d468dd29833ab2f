#include "bench/memcpy_speed.hpp"

#include <gtest/gtest.h>

namespace lightwell::bench {
namespace {

TEST(MemcpySpeed, IsAPlausibleSpeedOfMemory) {
  const MemcpySpeed speed = memcpy_speed(1 << 20);
  EXPECT_NEAR(speed.gigabytes_per_s * speed.seconds_per_copy, 1.048576e-3, 1e-9);
  // If the compiler removed the copies, it would be terabytes per second; the slowest board reaches more than 50 MB/s.
  EXPECT_LT(speed.gigabytes_per_s, 1000);
  EXPECT_GT(speed.gigabytes_per_s, 0.05);
}

TEST(MemcpySpeed, ZeroBytesTakeNoTime) { EXPECT_EQ(memcpy_speed(0).seconds_per_copy, 0); }

}  // namespace
}  // namespace lightwell::bench
