#include "calibration/solve/photometry/dark.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

/// Number of histogram bins for values that are not quantised: much finer than any noise.
constexpr int kFineLevels = 65536;
constexpr double kMaxDarkValue = 0.3;
constexpr double kWindow = 6;

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, "dark: " + what}; }

struct Histogram {
  std::vector<double> count;
  double total = 0;

  [[nodiscard]] int levels() const { return static_cast<int>(count.size()); }
  /// Picture value below which the fraction `share` of all values lies.
  [[nodiscard]] double quantile(double share) const {
    double below = 0;
    for (std::size_t k = 0; k < count.size(); ++k) {
      if (below + count[k] >= share * total && count[k] > 0) {
        if (k == 0) return 0;
        return (static_cast<double>(k) - 0.5 + (share * total - below) / count[k]) / (levels() - 1);
      }
      below += count[k];
    }
    return 1;
  }
};

Histogram histogram_of(std::span<const Picture> pictures) {
  Histogram out;
  out.count.resize(static_cast<std::size_t>(pictures.front().levels > 1 ? pictures.front().levels : kFineLevels));
  const double top = out.levels() - 1;
  for (const Picture& p : pictures)
    for (const float v : p.rgb)
      ++out.count[static_cast<std::size_t>(std::lround(std::clamp(static_cast<double>(v), 0.0, 1.0) * top))];
  for (const double c : out.count) out.total += c;
  return out;
}

double density(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi); }
double tail(double z) { return std::erfc(z / std::numbers::sqrt2) / 2; }
double probability(double a, double b) { return a > 0 ? tail(a) - tail(b) : tail(-b) - tail(-a); }

/// Mean and standard deviation of a Gaussian fitted to the counts of codes, with their variances.
struct Grouped {
  double mean = 0, deviation = 0, mean_variance = 0, deviation_variance = 0;
};

class GroupedLikelihood {
 public:
  /// Uses codes `first` to `last`; bin edges are linear values.
  GroupedLikelihood(const Histogram& histogram, const ResponseCurve& response, int first, int last) {
    const double top = histogram.levels() - 1;
    for (int k = first; k <= last; ++k) {
      const bool bottom = k == 0, end = k + 1 == histogram.levels();
      low_.push_back(bottom ? -1e9 : linearized(response, (k - 0.5) / top));
      high_.push_back(end ? 1e9 : linearized(response, (k + 0.5) / top));
      count_.push_back(histogram.count[static_cast<std::size_t>(k)]);
    }
  }

  /// Fisher scoring over mean and ln of the standard deviation.
  [[nodiscard]] Grouped solve(double mean, double deviation) const {
    Grouped out{mean, deviation};
    for (int pass = 0; pass < 100; ++pass) {
      double score[2] = {}, information[3] = {}, total = 0;
      for (const double c : count_) total += c;
      for (std::size_t k = 0; k < count_.size(); ++k) {
        const double a = std::clamp((low_[k] - out.mean) / out.deviation, -40.0, 40.0);
        const double b = std::clamp((high_[k] - out.mean) / out.deviation, -40.0, 40.0);
        const double p = std::max(probability(a, b), 1e-280);
        const double by_mean = (density(a) - density(b)) / out.deviation;
        const double by_log = a * density(a) - b * density(b);
        score[0] += count_[k] * by_mean / p;
        score[1] += count_[k] * by_log / p;
        information[0] += total * by_mean * by_mean / p;
        information[1] += total * by_mean * by_log / p;
        information[2] += total * by_log * by_log / p;
      }
      const double determinant = information[0] * information[2] - information[1] * information[1];
      if (!(determinant > 0) || !std::isfinite(determinant)) break;
      const double step_mean = (information[2] * score[0] - information[1] * score[1]) / determinant;
      const double step_log = (information[0] * score[1] - information[1] * score[0]) / determinant;
      out.mean_variance = information[2] / determinant;
      out.deviation_variance = information[0] / determinant * out.deviation * out.deviation;
      out.mean += std::clamp(step_mean, -out.deviation, out.deviation);
      out.deviation *= std::exp(std::clamp(step_log, -0.5, 0.5));
      if (std::abs(step_mean) < 1e-9 * out.deviation && std::abs(step_log) < 1e-9) break;
    }
    return out;
  }

 private:
  std::vector<double> low_, high_, count_;
};

/// Variance of the pictures' means: drift between pictures.
double drift_variance(std::span<const Picture> pictures, const ResponseCurve& response, double low, double high) {
  std::vector<double> means;
  for (const Picture& p : pictures) {
    double sum = 0, count = 0;
    for (const float v : p.rgb) {
      if (v < low || v > high) continue;
      sum += linearized(response, static_cast<double>(v));
      ++count;
    }
    if (count > 0) means.push_back(sum / count);
  }
  double mean = 0, squares = 0;
  for (const double m : means) mean += m / static_cast<double>(means.size());
  for (const double m : means) squares += (m - mean) * (m - mean);
  const auto n = static_cast<double>(means.size());
  return n > 1 ? squares / (n - 1) / n : 0;
}

}  // namespace

double difference_variance(std::span<const double> differences, double least, double& count) {
  double mean = median_of({differences.begin(), differences.end()});
  std::vector<double> centred(differences.begin(), differences.end());
  for (double& d : centred) d -= mean;
  // For rounded values the median absolute value may be 0; then iterate from `least`.
  double scale = std::max(scale_about_zero(centred), least);
  double variance = 0;
  count = 0;
  for (int pass = 0; pass < 8; ++pass) {
    double sum = 0, squares = 0;
    count = 0;
    for (const double d : differences) {
      if (std::abs(d - mean) > 5 * scale) continue;
      sum += d - mean;
      squares += (d - mean) * (d - mean);
      ++count;
    }
    if (count < 2) return 0;
    variance = (squares - sum * sum / count) / (count - 1);
    mean += sum / count;
    scale = std::max(std::sqrt(variance), least);
  }
  return variance / 2;
}

Result<double> dark_value_of(std::span<const Picture> pictures) {
  if (const Status s = check_alike(pictures, 1, "dark"); !s.ok()) return s;
  const double value = histogram_of(pictures).quantile(0.5);
  if (value > kMaxDarkValue)
    return invalid("the middle value is " + std::to_string(value) +
                   " of full scale: these pictures are not dark; cover the lens");
  return value;
}

Result<DarkEstimate> solve_dark(std::span<const Picture> pictures, const ResponseCurve& response, double gain) {
  if (const Status s = check_alike(pictures, 2, "dark"); !s.ok()) return s;
  if (!(gain > 0) || !std::isfinite(gain)) return invalid("gain must be positive");
  const Result<double> value = dark_value_of(pictures);
  if (!value) return value.status();
  const Histogram histogram = histogram_of(pictures);
  const double top = histogram.levels() - 1;
  // Use the upper half only, because the lower half may be censored.
  const double spread = std::max(histogram.quantile(0.8413) - *value, 0.25 / top);
  if (spread > 0.1)
    return invalid("the values differ by " + std::to_string(spread) +
                   " of full scale: light enters the camera; cover the lens");
  const int first = std::max(0, static_cast<int>(std::floor((*value - kWindow * spread) * top)) - 2);
  const int last = std::min(histogram.levels() - 1, static_cast<int>(std::ceil((*value + kWindow * spread) * top)) + 2);

  DarkEstimate out;
  double inside = 0, largest = 0, occupied = 0;
  for (int k = first; k <= last; ++k) {
    const double c = histogram.count[static_cast<std::size_t>(k)];
    inside += c;
    largest = std::max(largest, c);
    occupied += c > 0 ? 1 : 0;
  }
  out.outlier_share = 1 - inside / histogram.total;
  out.clipped = histogram.count[0] > 1e-4 * histogram.total;
  const auto linear_at = [&](double v) { return linearized(response, std::clamp(v, 0.0, 1.0)); };
  const double code = std::max(1e-12, linear_at(*value + 0.5 / top) - linear_at(*value - 0.5 / top));
  const auto in_x = [&](double deviation) { return deviation / (1 - out.black_level) / gain; };

  if (occupied < 3 || inside - largest < 30) {
    // One code, or two adjacent ones: only rounding is visible.
    out.resolved = false;
    out.black_level = std::clamp(linear_at(*value), 0.0, 0.49);
    out.black_deviation = code / std::sqrt(12.0);
    out.read_deviation = in_x(code / 2);
    return out;
  }
  const Grouped gauss =
      GroupedLikelihood(histogram, response, first, last)
          .solve(linear_at(*value), std::max(linear_at(*value + spread) - linear_at(*value), 0.2 * code));
  if (!(gauss.mean_variance > 0) || !std::isfinite(gauss.mean) || !(gauss.deviation > 0.15 * code)) {
    out.resolved = false;
    out.black_level = std::clamp(linear_at(*value), 0.0, 0.49);
    out.black_deviation = code / std::sqrt(12.0);
    out.read_deviation = in_x(code / 2);
    return out;
  }
  const double low = (first - 0.5) / top, high = (last + 0.5) / top;
  out.black_level = std::clamp(gauss.mean, 0.0, 0.49);
  out.black_deviation = std::sqrt(std::max(gauss.mean_variance, drift_variance(pictures, response, low, high)));
  out.read_noise = in_x(gauss.deviation);
  out.read_deviation = in_x(std::sqrt(gauss.deviation_variance));

  std::vector<double> differences;
  for (std::size_t k = 0; k + 1 < pictures.size(); k += 2)
    for (std::size_t i = 0; i < pictures[k].rgb.size(); ++i) {
      const float a = pictures[k].rgb[i], b = pictures[k + 1].rgb[i];
      if (a < low || a > high || b < low || b > high) continue;
      differences.push_back(linear_at(static_cast<double>(a)) - linear_at(static_cast<double>(b)));
    }
  if (std::all_of(differences.begin(), differences.end(), [](double d) { return d == 0; }))
    return invalid("two pictures are identical; each must be a new capture");
  if (out.clipped || gauss.deviation < 0.5 * code) return out;
  double count = 0;
  const double rounding = pictures.front().levels > 1 ? code * code / 12 : 0;
  const double total = difference_variance(differences, code / 2, count);
  const double variance = total - rounding;
  if (!(variance > 0)) return out;
  out.read_noise = in_x(std::sqrt(variance));
  out.read_deviation = in_x(total * std::sqrt(2 / count) / (2 * std::sqrt(variance)));
  return out;
}

}  // namespace lightwell::photometry
