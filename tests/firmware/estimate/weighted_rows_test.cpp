// The projection kernel sums within float rounding on every Highway target.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>

#include <gtest/gtest.h>

#include "estimate/common/cells.hpp"
#include "firmware/estimate/each_target.hpp"
#include "firmware/estimate/kernel_memory.hpp"

namespace lightwell::estimate {
namespace {

TEST(WeightedRows, AreSummedWithinFloatRounding) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    Random random(11);
    std::normal_distribution<float> normal;
    Fenced row_memory(301 * kRowCount * sizeof(float)), weight_memory(301 * 3 * sizeof(float));
    for (const std::size_t count : {0U, 1U, 2U, 3U, 7U, 16U, 255U, 256U, 257U, 300U}) {
      for (const bool at_the_end : {false, true}) {
        auto* rows = reinterpret_cast<float*>(row_memory.place(count * kRowCount * sizeof(float), at_the_end));
        auto* weights = reinterpret_cast<float*>(weight_memory.place(count * 3 * sizeof(float), at_the_end));
        for (std::size_t i = 0; i < count * kRowCount; ++i) rows[i] = normal(random);
        for (std::size_t i = 0; i < count * 3; ++i) weights[i] = std::exp(3 * normal(random));
        struct {
          float before[64], out[3][kRowCount], after[64];
        } got;
        for (auto* guard : {&got.before, &got.after}) std::fill(std::begin(*guard), std::end(*guard), 12345.0F);
        for (auto& channel : got.out)
          for (float& v : channel) v = normal(random);
        const auto in = got;
        add_weighted_rows(rows, weights, count, got.out);
        for (const auto* guard : {&got.before, &got.after})
          for (const float v : *guard) ASSERT_EQ(v, 12345.0F);
        for (std::size_t c = 0; c < 3; ++c) {
          for (std::size_t i = 0; i < kRowCount; ++i) {
            double sum = in.out[c][i], amount = std::abs(sum);
            for (std::size_t k = 0; k < count; ++k) {
              const double product = static_cast<double>(weights[3 * k + c]) * rows[k * kRowCount + i];
              sum += product;
              amount += std::abs(product);
            }
            // Recursive summation of n terms, each product rounded at most once more: Higham, "Accuracy and Stability
            // of Numerical Algorithms" (2002), eq. 3.4, with unit roundoff 2^-24.
            ASSERT_NEAR(got.out[c][i], sum, static_cast<double>(count + 2) * std::exp2(-24) * amount)
                << count << " rows, channel " << c << ", number " << i;
          }
        }
      }
    }
  });
}

}  // namespace
}  // namespace lightwell::estimate
