#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/quantile.hpp>

namespace lightwell {
namespace {

using Values = std::vector<double>;

TEST(Median, OddCountsGiveTheMiddleEvenCountsTheMeanOfTwo) {
  EXPECT_EQ(median(Values{7}), 7);
  EXPECT_EQ(median(Values{9, 1, 4}), 4);
  EXPECT_EQ(median(Values{8, 1, 4, 2}), 3);
  EXPECT_EQ(median(Values{2, 2, 2, 5}), 2);
}

TEST(Median, OfInfinitiesIsInfinite) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(median(Values{1, kInfinity, kInfinity}), kInfinity);
  EXPECT_EQ(median(Values{-kInfinity, 3, kInfinity}), 3);
}

TEST(LowerQuantile, HasAtLeastTheShareAtOrBelow) {
  EXPECT_EQ(lower_quantile(Values{4, 3, 2, 1}, 0), 1);
  EXPECT_EQ(lower_quantile(Values{4, 3, 2, 1}, 0.25), 1);
  EXPECT_EQ(lower_quantile(Values{4, 3, 2, 1}, 0.26), 2);
  EXPECT_EQ(lower_quantile(Values{4, 3, 2, 1}, 0.5), 2) << "the lower median";
  EXPECT_EQ(lower_quantile(Values{4, 3, 2, 1}, 1), 4);
}

TEST(UpperQuantile, HasMoreThanTheShareAtOrBelow) {
  EXPECT_EQ(upper_quantile(Values{4, 3, 2, 1}, 0), 1);
  EXPECT_EQ(upper_quantile(Values{4, 3, 2, 1}, 0.24), 1);
  EXPECT_EQ(upper_quantile(Values{4, 3, 2, 1}, 0.25), 2);
  EXPECT_EQ(upper_quantile(Values{4, 3, 2, 1}, 0.5), 3) << "the upper median";
  EXPECT_EQ(upper_quantile(Values{4, 3, 2, 1}, 1), 4);
}

TEST(Quantiles, HundredValues) {
  Values values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  EXPECT_EQ(lower_quantile(values, 0.99), 99);
  EXPECT_EQ(upper_quantile(values, 0.99), 100);
}

TEST(Quantiles, OfAnEmptySampleOrOneWithNanAreNan) {
  Values empty;
  EXPECT_TRUE(std::isnan(median(empty)));
  EXPECT_TRUE(std::isnan(lower_quantile(empty, 0.5)));
  EXPECT_TRUE(std::isnan(upper_quantile(empty, 0.5)));
  for (const Values& values : {Values{std::nan(""), 1, 2}, Values{1, 2, std::nan("")}})
    EXPECT_TRUE(std::isnan(median(Values(values)))) << values[0];
}

TEST(Quantiles, OfOtherTypesAndContainers) {
  std::array<int, 4> whole{40, 10, 30, 20};
  EXPECT_EQ(upper_quantile(whole, 0.5), 30);
  std::vector<float> single{2.5F, 0.5F, 1.5F};
  EXPECT_EQ(order_statistic(single, 1), 1.5);
  EXPECT_EQ(order_statistic(single, 99), 2.5) << "the largest value beyond the end";
  std::vector<std::uint32_t> counts{4'000'000'000U, 1, 2};
  EXPECT_EQ(lower_quantile(counts, 1), 4e9);
}

}  // namespace
}  // namespace lightwell
