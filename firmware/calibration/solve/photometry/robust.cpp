#include "calibration/solve/photometry/robust.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <lightwell/quantile.hpp>

namespace lightwell::photometry {

constexpr double kTukey = 4.685;

double weighted_median(std::span<const double> values, std::span<const double> weights) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  const double half = std::accumulate(weights.begin(), weights.end(), 0.0) / 2;
  double sum = 0;
  for (const std::size_t i : order) {
    sum += weights[i];
    if (sum >= half && weights[i] > 0) return values[i];
  }
  return 0;
}

double scale_about_zero(std::span<const double> values) {
  std::vector<double> sizes(values.begin(), values.end());
  for (double& v : sizes) v = std::abs(v);
  return sizes.empty() ? 0 : 1.482602 * median(sizes);
}

ClippedMean clipped_mean(std::span<const double> values, double first, double least, int passes) {
  std::vector<double> centred(values.begin(), values.end());
  ClippedMean out;
  out.mean = median(centred);
  for (double& v : centred) v -= out.mean;
  out.deviation = std::max(scale_about_zero(centred), first);
  for (int pass = 0; pass < passes; ++pass) {
    double sum = 0, squares = 0;
    out.count = 0;
    for (const double v : values) {
      const double off = v - out.mean;
      if (std::abs(off) > 5 * out.deviation) continue;
      sum += off;
      squares += off * off;
      ++out.count;
    }
    if (out.count < 2) break;
    out.variance = (squares - sum * sum / out.count) / (out.count - 1);
    out.deviation = std::max(std::sqrt(std::max(0.0, out.variance)), least);
    out.mean += sum / out.count;
  }
  return out;
}

double tukey_weight(double u) {
  const double a = u / kTukey, s = 1 - a * a;
  return std::abs(a) < 1 ? s * s : 0;
}

double tukey_loss(double u) {
  const double a = u / kTukey, s = 1 - a * a;
  return kTukey * kTukey / 6 * (std::abs(a) < 1 ? 1 - s * s * s : 1);
}

double tukey_slope(double u) {
  const double a = u / kTukey, s = 1 - a * a;
  return std::abs(a) < 1 ? s * (s - 4 * a * a) : 0;
}

}  // namespace lightwell::photometry
