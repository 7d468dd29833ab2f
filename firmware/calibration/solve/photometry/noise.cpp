#include "calibration/solve/photometry/noise.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Core>
#include <Eigen/LU>

#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

constexpr std::size_t kBins = 24;
constexpr std::size_t kMinCount = 200;
constexpr double kMinCodes = 0.3;
constexpr double kMinRange = 3;

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, "noise: " + what}; }

/// Converts picture values to x, with the slope dx / dv.
class Linear {
 public:
  explicit Linear(const PhotometricCalibration& p) : p_(p) {}
  [[nodiscard]] double x(double v) const {
    return (linearized(p_.response, v) - p_.black_level) / (1 - p_.black_level);
  }
  [[nodiscard]] double slope(double v) const {
    constexpr double kStep = 1.0 / 512;
    const double low = std::max(0.0, v - kStep), high = std::min(1.0, v + kStep);
    return (x(high) - x(low)) / (high - low);
  }

 private:
  const PhotometricCalibration& p_;
};

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
  fit.line = {0, std::max(median_of(slopes), 1e-15)};
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

Result<std::vector<NoiseLevel>> noise_levels(std::span<const FlatPair> pairs,
                                             const PhotometricCalibration& photometry) {
  if (pairs.empty()) return invalid("no pair of flat pictures");
  const Linear linear(photometry);
  std::vector<NoiseLevel> out;
  std::size_t hidden = 0;
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    const FlatPair& pair = pairs[n];
    const std::string name = "flat pair " + std::to_string(n);
    const Picture both[] = {pair.a, pair.b};
    if (const Status s = check_alike(both, 2, name); !s.ok()) return s;
    if (!(pair.gain > 0) || !std::isfinite(pair.gain)) return invalid(name + ": gain must be positive");
    // Pictures that are entirely white or black may be identical.
    const bool shades = std::any_of(pair.a.rgb.begin(), pair.a.rgb.end(), [&](float v) {
      return static_cast<double>(v) > 0 && static_cast<double>(v) < photometry.saturation;
    });
    if (shades && pair.a.rgb == pair.b.rgb)
      return invalid(name + ": both pictures are identical; each must be a new capture");
    const double code = pair.a.levels > 1 ? 1.0 / (pair.a.levels - 1) : 0;
    std::vector<Bin> bins(kBins);
    for (std::size_t i = 0; i < pair.a.rgb.size(); ++i) {
      const double va = static_cast<double>(pair.a.rgb[i]), vb = static_cast<double>(pair.b.rgb[i]);
      const double a = linear.x(va), b = linear.x(vb), mean = (a + b) / 2;
      // Bins are uniform in the square root, whose noise is constant.
      auto& bin = bins[static_cast<std::size_t>(std::clamp(std::sqrt(std::max(mean, 0.0)), 0.0, 0.999) * kBins)];
      if (std::max(va, vb) >= photometry.saturation || std::min(va, vb) <= code / 2) {
        ++bin.clipped;
        continue;
      }
      bin.differences.push_back(a - b);
      bin.sum += mean;
      const double slope = linear.slope((va + vb) / 2);
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
      const double total = difference_variance(bin.differences, std::max(1e-9, slope * code / 2), level.count);
      level.variance = total - level.rounding;
      if (code > 0 && std::sqrt(std::max(0.0, total)) < kMinCodes * slope * code) {
        ++hidden;
        continue;
      }
      out.push_back(level);
    }
  }
  if (out.empty() && hidden > 0)
    return invalid("rounding hides the noise: it is less than 0.3 of a code; take the flats at a higher gain");
  if (out.empty())
    return invalid(
        "no level has 200 pixels between dark and saturated; light the flats so that they are between 5 % and 90 %");
  return out;
}

Result<NoiseEstimate> solve_noise(std::span<const NoiseLevel> levels, const std::optional<DarkEstimate>& dark) {
  if (levels.size() < 3)
    return invalid(std::to_string(levels.size()) +
                   " levels of light, at least three are needed; take pairs at more exposures");
  std::vector<Row> rows;
  double lowest = levels.front().mean, highest = 0;
  for (const NoiseLevel& l : levels) {
    if (!std::isfinite(l.mean) || !std::isfinite(l.variance) || !(l.count > 1) || !(l.gain > 0))
      return invalid("a level has an invalid mean, variance or count");
    rows.push_back({{l.gain * l.gain, l.gain * l.mean}, l.variance, l.rounding, l.count, 0});
    lowest = std::min(lowest, l.mean);
    highest = std::max(highest, l.mean);
  }
  if (!(highest >= kMinRange * std::max(lowest, 1e-9)))
    return invalid("the levels of light span " + std::to_string(lowest) + " to " + std::to_string(highest) +
                   " only; let the brightest be at least three times the darkest");
  const bool with_dark = dark && dark->resolved && dark->read_deviation > 0;
  if (with_dark)
    rows.push_back({{1, 0}, dark->read_noise * dark->read_noise, 0, 1, 2 * dark->read_noise * dark->read_deviation});
  const Fit fit = fit_line(rows);
  NoiseEstimate out;
  out.shot_noise = fit.line(1);
  out.shot_deviation = std::sqrt(std::max(0.0, fit.covariance(1, 1)));
  if (!(out.shot_noise > 3 * out.shot_deviation))
    return invalid("the variance does not grow with light; turn off noise reduction, and do not take JPEG");
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
