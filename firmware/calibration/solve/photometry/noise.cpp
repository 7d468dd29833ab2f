#include "calibration/solve/photometry/noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <Eigen/Core>
#include <Eigen/LU>

#include <lightwell/quantile.hpp>

#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

/// Number of histogram bins for values that are not quantised: much finer than any noise.
constexpr int kFineLevels = 65536;
constexpr double kMaxDarkValue = 0.3;
constexpr double kWindow = 6;

struct Histogram {
  std::vector<double> count;
  double total = 0;

  [[nodiscard]] int levels() const { return static_cast<int>(count.size()); }
  /// Picture value below which the fraction `share` of all values lies, interpolated within a bin.
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

/// Maximum likelihood by Fisher scoring over mean and ln of the standard deviation, from the codes `first` to `last`.
Grouped fit_grouped(const Histogram& histogram, const ResponseCurve& response, int first, int last, double mean,
                    double deviation) {
  struct CodeBin {
    double low, high, count;  ///< Edges are linear values.
  };
  std::vector<CodeBin> bins;
  const double top = histogram.levels() - 1;
  double total = 0;
  for (int k = first; k <= last; ++k) {
    const bool bottom = k == 0, end = k + 1 == histogram.levels();
    bins.push_back({bottom ? -1e9 : linearized(response, (k - 0.5) / top),
                    end ? 1e9 : linearized(response, (k + 0.5) / top), histogram.count[static_cast<std::size_t>(k)]});
    total += bins.back().count;
  }
  Grouped out{mean, deviation};
  for (int pass = 0; pass < 100; ++pass) {
    double score[2] = {}, information[3] = {};
    for (const auto& [low, high, count] : bins) {
      const double a = std::clamp((low - out.mean) / out.deviation, -40.0, 40.0);
      const double b = std::clamp((high - out.mean) / out.deviation, -40.0, 40.0);
      const double p = std::max(probability(a, b), 1e-280);
      const double by_mean = (density(a) - density(b)) / out.deviation;
      const double by_log = a * density(a) - b * density(b);
      score[0] += count * by_mean / p;
      score[1] += count * by_log / p;
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

/// Noise variance of one picture from the differences of two pictures of the same scene: half the mean square about the
/// mean; and the number of differences used. `least`: lower limit of sigma for the rejection.
std::pair<double, double> difference_variance(std::span<const double> differences, double least) {
  // For rounded values the median absolute value may be 0; then the rejection starts from `least`.
  const ClippedMean mean = clipped_mean(differences, least, least, 8);
  return {mean.count < 2 ? 0 : mean.variance / 2, mean.count};
}

constexpr std::size_t kBins = 24;
constexpr std::size_t kMinCount = 200;
constexpr double kMinCodes = 0.3;
constexpr double kMinRange = 3;

/// dx / dv at a picture value.
double slope_at(const PhotometricCalibration& p, double v) {
  constexpr double kStep = 1.0 / 512;
  const double low = std::max(0.0, v - kStep), high = std::min(1.0, v + kStep);
  return (linear_value(p, high) - linear_value(p, low)) / (high - low);
}

struct Bin {
  std::vector<double> differences;
  double sum = 0, slope_squares = 0;
  double clipped = 0;  ///< Number of differences with a value that is saturated or at the lowest code.
};

struct Fit {
  Eigen::Vector2d line = Eigen::Vector2d::Zero();  ///< read², shot.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double scatter = 1;
};

struct Row {
  Eigen::Vector2d factors;
  double variance = 0;
  double rounding = 0, count = 0;
  double deviation = 0;  ///< Standard deviation, if it is fixed (dark frames).
};

/// Standard deviation of a row's variance. It is proportional to the variance; the line's value is used instead of the
/// row's, because weighting by the row's own noise would bias the line downwards.
double deviation_of(const Row& row, const Eigen::Vector2d& line) {
  if (row.deviation > 0) return row.deviation;
  const double total = std::max(row.factors.dot(line), 0.1 * row.variance) + row.rounding;
  return std::max(total, 1e-30) * std::sqrt(2 / row.count);
}

Fit fit_line(const std::vector<Row>& rows) {
  Fit fit;
  // Initial line: the median ratio of variance and mean.
  std::vector<double> slopes;
  for (const Row& r : rows)
    if (r.factors(1) > 0) slopes.push_back(r.variance / r.factors(1));
  fit.line = {0, slopes.empty() ? 1e-15 : std::max(median(slopes), 1e-15)};
  std::vector<double> scaled(rows.size());
  for (int pass = 0; pass < 40; ++pass) {
    for (std::size_t k = 0; k < rows.size(); ++k)
      scaled[k] = (rows[k].variance - rows[k].factors.dot(fit.line)) / deviation_of(rows[k], fit.line);
    fit.scatter = std::max(1.0, scale_about_zero(scaled));
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const double deviation = deviation_of(rows[k], fit.line);
      // No robust weights at first, because a poor start would reject inliers.
      const double weight = (pass < 5 ? 1 : tukey_weight(scaled[k] / fit.scatter)) / (deviation * deviation);
      normal += weight * rows[k].factors * rows[k].factors.transpose();
      right += weight * rows[k].factors * rows[k].variance;
    }
    // Normalise the columns: read² is about 1e-6, shot 1e-4.
    const Eigen::Vector2d size = normal.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
    const Eigen::Matrix2d even = size.asDiagonal() * normal * size.asDiagonal();
    const Eigen::Matrix2d inverse = size.asDiagonal() * even.inverse() * size.asDiagonal();
    const Eigen::Vector2d line = inverse * right;
    const bool still = (line - fit.line).cwiseAbs().maxCoeff() <= 1e-12 * line.cwiseAbs().maxCoeff();
    fit.line = line;
    // Tukey's biweight has an efficiency of 95 %.
    fit.covariance = fit.scatter * fit.scatter / 0.95 * inverse;
    if (still && pass > 6) break;
  }
  return fit;
}

}  // namespace

Result<double> dark_value_of(std::span<const Picture> pictures) {
  if (const Status s = check_alike(pictures, 1, "dark"); !s.ok()) return s;
  const double value = histogram_of(pictures).quantile(0.5);
  if (value > kMaxDarkValue)
    return invalid_argument("dark: the middle value is " + std::to_string(value) +
                            " of full scale: these pictures are not dark; cover the lens");
  return value;
}

Result<DarkEstimate> solve_dark(std::span<const Picture> pictures, const ResponseCurve& response, double gain) {
  if (const Status s = check_alike(pictures, 2, "dark"); !s.ok()) return s;
  if (!(gain > 0) || !std::isfinite(gain)) return invalid_argument("dark: gain must be positive");
  const Result<double> value = dark_value_of(pictures);
  if (!value) return value.status();
  const Histogram histogram = histogram_of(pictures);
  const double top = histogram.levels() - 1;
  // Use the upper half only, because the lower half may be censored.
  const double spread = std::max(histogram.quantile(0.8413) - *value, 0.25 / top);
  if (spread > 0.1)
    return invalid_argument("dark: the values differ by " + std::to_string(spread) +
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

  const auto unresolved = [&] {
    out.resolved = false;
    out.black_level = std::clamp(linear_at(*value), 0.0, 0.49);
    out.black_deviation = code / std::sqrt(12.0);
    out.read_deviation = in_x(code / 2);
    return out;
  };
  // One code, or two adjacent ones: only rounding is visible.
  if (occupied < 3 || inside - largest < 30) return unresolved();
  const Grouped gauss = fit_grouped(histogram, response, first, last, linear_at(*value),
                                    std::max(linear_at(*value + spread) - linear_at(*value), 0.2 * code));
  if (!(gauss.mean_variance > 0) || !std::isfinite(gauss.mean) || !(gauss.deviation > 0.15 * code)) return unresolved();
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
    return invalid_argument("dark: two pictures are identical; each must be a new capture");
  if (out.clipped || gauss.deviation < 0.5 * code) return out;
  const double rounding = pictures.front().levels > 1 ? code * code / 12 : 0;
  const auto [total, count] = difference_variance(differences, code / 2);
  const double variance = total - rounding;
  if (!(variance > 0)) return out;
  out.read_noise = in_x(std::sqrt(variance));
  out.read_deviation = in_x(total * std::sqrt(2 / count) / (2 * std::sqrt(variance)));
  return out;
}

Result<std::vector<NoiseLevel>> noise_levels(std::span<const FlatPair> pairs,
                                             const PhotometricCalibration& photometry) {
  if (pairs.empty()) return invalid_argument("noise: no pair of flat pictures");
  std::vector<NoiseLevel> out;
  std::size_t hidden = 0;
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    const FlatPair& pair = pairs[n];
    const std::string name = "flat pair " + std::to_string(n);
    const Picture both[] = {pair.a, pair.b};
    if (const Status s = check_alike(both, 2, name); !s.ok()) return s;
    if (!(pair.gain > 0) || !std::isfinite(pair.gain))
      return invalid_argument("noise: " + name + ": gain must be positive");
    // Pictures that are entirely white or black may be identical.
    const bool shades = std::any_of(pair.a.rgb.begin(), pair.a.rgb.end(), [&](float v) {
      return static_cast<double>(v) > 0 && static_cast<double>(v) < photometry.saturation;
    });
    if (shades && pair.a.rgb == pair.b.rgb)
      return invalid_argument("noise: " + name + ": both pictures are identical; each must be a new capture");
    const double code = pair.a.levels > 1 ? 1.0 / (pair.a.levels - 1) : 0;
    std::vector<Bin> bins(kBins);
    for (std::size_t i = 0; i < pair.a.rgb.size(); ++i) {
      const double va = static_cast<double>(pair.a.rgb[i]), vb = static_cast<double>(pair.b.rgb[i]);
      const double a = linear_value(photometry, va), b = linear_value(photometry, vb), mean = (a + b) / 2;
      // Bins are uniform in the square root, whose noise is constant.
      auto& bin = bins[static_cast<std::size_t>(std::clamp(std::sqrt(std::max(mean, 0.0)), 0.0, 0.999) * kBins)];
      if (std::max(va, vb) >= photometry.saturation || std::min(va, vb) <= code / 2) {
        ++bin.clipped;
        continue;
      }
      bin.differences.push_back(a - b);
      bin.sum += mean;
      const double slope = slope_at(photometry, (va + vb) / 2);
      bin.slope_squares += slope * slope;
    }
    for (const Bin& bin : bins) {
      // Censored tails would bias the variance.
      if (bin.differences.size() < kMinCount || bin.clipped > 1e-3 * static_cast<double>(bin.differences.size()))
        continue;
      const auto size = static_cast<double>(bin.differences.size());
      const double slope = std::sqrt(bin.slope_squares / size);
      NoiseLevel level;
      level.mean = bin.sum / size;
      level.gain = pair.gain;
      level.rounding = slope * slope * code * code / 12;
      const auto [total, count] = difference_variance(bin.differences, std::max(1e-9, slope * code / 2));
      level.count = count;
      level.variance = total - level.rounding;
      if (code > 0 && std::sqrt(std::max(0.0, total)) < kMinCodes * slope * code) {
        ++hidden;
        continue;
      }
      out.push_back(level);
    }
  }
  if (out.empty() && hidden > 0)
    return invalid_argument(
        "noise: rounding hides the noise: it is less than 0.3 of a code; take the flats at a higher gain");
  if (out.empty())
    return invalid_argument(
        "noise: no level has 200 pixels between dark and saturated; light the flats so that they are between 5 % and "
        "90 %");
  return out;
}

Result<NoiseEstimate> solve_noise(std::span<const NoiseLevel> levels, const std::optional<DarkEstimate>& dark) {
  if (levels.size() < 3)
    return invalid_argument("noise: " + std::to_string(levels.size()) +
                            " levels of light, at least three are needed; take pairs at more exposures");
  std::vector<Row> rows;
  double lowest = levels.front().mean, highest = 0;
  for (const NoiseLevel& l : levels) {
    if (!std::isfinite(l.mean) || !std::isfinite(l.variance) || !(l.count > 1) || !(l.gain > 0))
      return invalid_argument("noise: a level has an invalid mean, variance or count");
    rows.push_back({{l.gain * l.gain, l.gain * l.mean}, l.variance, l.rounding, l.count, 0});
    lowest = std::min(lowest, l.mean);
    highest = std::max(highest, l.mean);
  }
  if (!(highest >= kMinRange * std::max(lowest, 1e-9)))
    return invalid_argument("noise: the levels of light span " + std::to_string(lowest) + " to " +
                            std::to_string(highest) + " only; let the brightest be at least three times the darkest");
  const bool with_dark = dark && dark->resolved && dark->read_deviation > 0;
  if (with_dark)
    rows.push_back({{1, 0}, dark->read_noise * dark->read_noise, 0, 1, 2 * dark->read_noise * dark->read_deviation});
  const Fit fit = fit_line(rows);
  NoiseEstimate out;
  out.shot_noise = fit.line(1);
  out.shot_deviation = std::sqrt(std::max(0.0, fit.covariance(1, 1)));
  if (!(out.shot_noise > 3 * out.shot_deviation))
    return invalid_argument(
        "noise: the variance does not grow with light; turn off noise reduction, and do not take JPEG");
  const double squared = std::max(0.0, fit.line(0)), squared_deviation = std::sqrt(std::max(0.0, fit.covariance(0, 0)));
  out.read_noise = std::sqrt(squared);
  // First-order propagation diverges at read_noise 0, so it is limited by the root of read²'s standard deviation.
  out.read_deviation =
      std::min(squared_deviation / (2 * std::max(out.read_noise, 1e-12)), std::sqrt(squared_deviation));
  out.covariance = {fit.covariance(0, 0), fit.covariance(0, 1), fit.covariance(1, 0), fit.covariance(1, 1)};
  out.scatter = fit.scatter;
  return out;
}

}  // namespace lightwell::photometry
