// Robust statistics shared by the solvers of this folder.
#pragma once

#include <span>

namespace lightwell::photometry {

/// Weighted (lower) median: the smallest value with half of the total weight at or below it. 0 if that weight is 0.
[[nodiscard]] double weighted_median(std::span<const double> values, std::span<const double> weights);
/// Standard deviation of zero-mean Gaussian values, from the median of their absolute values; 0 without values.
[[nodiscard]] double scale_about_zero(std::span<const double> values);

struct ClippedMean {
  double mean = 0;
  double variance = 0;   ///< Of one value.
  double deviation = 0;  ///< Its square root, limited from below.
  double count = 0;  ///< Number of values used; below 2: variance and deviation are those of the previous iteration.
};

/// Mean without values more than five standard deviations off, iterated `passes` times from the median and
/// scale_about_zero(). The standard deviation is at least `first` there, and `least` later.
[[nodiscard]] ClippedMean clipped_mean(std::span<const double> values, double first, double least, int passes);

/// Weight of Tukey's biweight (Beaton & Tukey 1974), constant 4.685: 95 % efficiency for Gaussian noise. `u`: sigmas.
[[nodiscard]] double tukey_weight(double u);
/// Loss of Tukey's biweight: u²/2 for small u, 3.66 for outliers.
[[nodiscard]] double tukey_loss(double u);
/// Derivative of u * tukey_weight(u).
[[nodiscard]] double tukey_slope(double u);

}  // namespace lightwell::photometry
