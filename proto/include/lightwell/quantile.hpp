// Quantiles of a sample x_0 <= x_1 <= ... <= x_(n-1), after Hyndman and Fan 1996, "Sample Quantiles in Statistical
// Packages":
//   lower_quantile   the smallest value with at least the given share of the sample at or below it (nearest rank)
//   upper_quantile   the smallest value with more than that share at or below it
//   median           the mean of both at 1/2
// All reorder the values in place and take linear time. The result is NaN if the sample is empty or contains NaN.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <ranges>

namespace lightwell {

/// x_rank; x_(n-1) for a higher rank.
template <std::ranges::random_access_range Values>
[[nodiscard]] double order_statistic(Values&& values, std::size_t rank) {
  const auto first = std::ranges::begin(values);
  const auto count = static_cast<std::size_t>(std::ranges::size(values));
  const auto last = first + static_cast<std::ptrdiff_t>(count);
  if (count == 0 || std::any_of(first, last, [](auto v) { return std::isnan(static_cast<double>(v)); }))
    return std::numeric_limits<double>::quiet_NaN();
  const auto at = first + static_cast<std::ptrdiff_t>(std::min(rank, count - 1));
  std::nth_element(first, at, last);
  return static_cast<double>(*at);
}

/// x_(ceil(share n) - 1) for a share of 0 to 1; x_0 for the share 0. At 1/2 this is the lower median.
template <std::ranges::random_access_range Values>
[[nodiscard]] double lower_quantile(Values&& values, double share) {
  const double rank = std::ceil(share * static_cast<double>(std::ranges::size(values)));
  return order_statistic(values, static_cast<std::size_t>(std::max(rank, 1.0)) - 1);
}

/// x_floor(share n) for a share of 0 to 1; x_(n-1) for the share 1. At 1/2 this is the upper median.
template <std::ranges::random_access_range Values>
[[nodiscard]] double upper_quantile(Values&& values, double share) {
  return order_statistic(values, static_cast<std::size_t>(share * static_cast<double>(std::ranges::size(values))));
}

/// The middle value of an odd number of values, the mean of the two middle values of an even number.
template <std::ranges::random_access_range Values>
[[nodiscard]] double median(Values&& values) {
  const double lower = lower_quantile(values, 0.5);
  return (lower + upper_quantile(values, 0.5)) / 2;
}

}  // namespace lightwell
