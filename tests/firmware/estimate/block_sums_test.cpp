// Blocks are the sums of their columns on every Highway target.
#include <algorithm>
#include <cstdint>

#include <gtest/gtest.h>

#include "estimate/panorama/kernels/lane_sums.hpp"
#include "firmware/estimate/each_target.hpp"
#include "firmware/estimate/kernel_memory.hpp"

namespace lightwell::estimate {
namespace {

TEST(BlockSums, SumLanesOverColumns) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Random random(9);
    for (const int edge : {1, 2, 4, 8, 16}) {
      for (int channels = 1; channels <= 3; ++channels) {
        for (const std::size_t blocks : {1U, 2U, 3U, 5U, 7U, 8U, 15U, 16U, 17U, 31U, 33U, 40U, 81U}) {
          const auto columns = static_cast<std::size_t>(edge), count = static_cast<std::size_t>(channels);
          const std::size_t lanes = blocks * columns * count;
          Sums got(lanes);
          Guarded<std::uint32_t> across(lanes);
          const bool full = random() % 3 == 0;
          for (std::size_t i = 0; i < lanes; ++i) {
            // Up to the largest sum of 16 rows of 65535.
            got.sum.data()[i] = full ? 16 * 65535U : below(random, 16 * 65535);
            got.early.data()[i] = full ? 136 * 65535U : below(random, 136 * 65535);
            got.peak.data()[i] = static_cast<std::uint16_t>(random());
            across.data()[i] = static_cast<std::uint32_t>(random());
          }
          const Sums in = got;
          sum_blocks(got.out(), channels, edge, blocks, across.data());
          ASSERT_TRUE(got.guards_hold() && across.guards_hold());
          for (std::size_t block = 0; block < blocks; ++block) {
            for (std::size_t c = 0; c < count; ++c) {
              std::uint64_t sum = 0, early = 0, moved = 0;
              unsigned peak = 0;
              for (std::size_t column = 0; column < columns; ++column) {
                const std::size_t lane = (block * columns + column) * count + c;
                sum += in.sum[lane];
                early += in.early[lane];
                moved += column * in.sum[lane];
                peak = std::max<unsigned>(peak, in.peak[lane]);
              }
              const std::size_t at = block * count + c;
              const auto what = testing::Message() << "edge " << edge << ", " << channels << " channels, block "
                                                   << block << " of " << blocks << ", channel " << c;
              ASSERT_EQ(got.sum[at], sum) << what;
              ASSERT_EQ(got.early[at], early) << what;
              ASSERT_EQ(across[at], moved) << what;
              ASSERT_EQ(got.peak[at], peak) << what;
            }
          }
        }
      }
    }
  });
}

}  // namespace
}  // namespace lightwell::estimate
