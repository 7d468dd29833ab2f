// What all solvers of this folder share: estimates that a few wrong observations do not move.
#pragma once

#include <span>
#include <vector>

namespace lightwell::photometry {

/// 0 of nothing.
[[nodiscard]] double median_of(std::vector<double> values);
/// The value with half of all weight on either side; 0 where there is no weight.
[[nodiscard]] double weighted_median(std::span<const double> values, std::span<const double> weights);
/// Standard deviation of Gaussian values by the median of their absolute values, which are about zero.
[[nodiscard]] double scale_about_zero(std::span<const double> values);

/// Tukey's biweight (Beaton & Tukey 1974) with the constant 4.685, 95 % efficient where noise is Gaussian. `u` is a
/// residual in standard deviations.
[[nodiscard]] double tukey_weight(double u);
/// u²/2 for small u, 3.66 for those that do not count.
[[nodiscard]] double tukey_loss(double u);
/// Derivative of u * tukey_weight(u).
[[nodiscard]] double tukey_slope(double u);

}  // namespace lightwell::photometry
