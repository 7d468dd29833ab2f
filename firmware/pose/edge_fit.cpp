#include "pose/edge_fit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include <lightwell/quantile.hpp>

#include "pose/normal_table.hpp"

namespace lightwell {

LinearPicture::LinearPicture(const GreyPicture& picture, std::span<const float> linear) : picture_(picture) {
  for (std::size_t i = 0; i < values_.size(); ++i)
    values_[i] = linear.empty() ? static_cast<double>(i) : 255.0 * static_cast<double>(linear[i]);
}

double LinearPicture::step_at(double level) const {
  const auto above = std::upper_bound(values_.begin() + 1, values_.end() - 1, level);
  return std::max(*above - *(above - 1), 1e-6);
}

bool LinearPicture::along(Eigen::Vector2d from, Eigen::Vector2d step, std::span<double> out) const {
  const Eigen::Vector2d last = from + step * static_cast<double>(out.size() - 1);
  const Eigen::Vector2d low = from.cwiseMin(last), high = from.cwiseMax(last);
  // A margin for the rounding errors of the accumulated steps.
  if (!(low.x() >= 1e-6 && low.y() >= 1e-6 && high.x() < picture_.width - 1 - 1e-6 &&
        high.y() < picture_.height - 1 - 1e-6))
    return false;
  double px = from.x(), py = from.y();
  for (double& v : out) {
    // The coordinates are positive, so that truncation rounds down.
    const int x = static_cast<int>(px), y = static_cast<int>(py);
    const double u = px - x, w = py - y;
    const std::uint8_t* const row = picture_.data.data() + static_cast<std::size_t>(y) * picture_.stride + x;
    const double above = values_[row[0]] + u * (values_[row[1]] - values_[row[0]]);
    const std::uint8_t* const next = row + picture_.stride;
    const double below = values_[next[0]] + u * (values_[next[1]] - values_[next[0]]);
    v = above + w * (below - above);
    px += step.x();
    py += step.y();
  }
  return true;
}

namespace {

using Eigen::Vector2d;
using Parameters = Eigen::Matrix<double, 8, 1>;
using Normal = Eigen::Matrix<double, 8, 8>;

constexpr double kMinContrast = 5;  ///< In steps of the pixel values.
/// Standard deviation of the rounding of pixel values to integers, 1/sqrt(12), in steps.
constexpr double kRounding = 0.29;
/// Prior standard deviation of the relative illumination gradient along the edge, 1/px: 1 % halves it over 50 px.
constexpr double kIlluminationGradient = 0.01;
constexpr double kIlluminationGradientAcross = 0.003;  // Smaller, because a gradient across resembles blur.
constexpr double kUnknown =
    6;  ///< Parameters that the pixels determine; the two gradients are mostly set by the prior.

/// Prior standard deviation of the parabola's quadratic term at its end, px. The radius of curvature of a straight edge
/// in the picture is about the size of the picture. The prior matters for short edges, which noise would bend more.
double bend_deviation(const LinearPicture& picture, double end) { return 0.5 * (8.0 / picture.sides()) * end * end; }

/// Maximum number of points along an edge; more add little accuracy.
constexpr std::size_t kMaxPoints = 48;
/// Standard deviation of one point relative to the prior of the quadratic term, px.
constexpr double kPointDeviation = 0.5;
/// Lower limit of the standard deviation of the points: a smaller scatter is by chance.
constexpr double kMinScatter_px = 0.03;

/// Noise of an edge beyond the scatter around it. Blur mixes the edge with the next but one cells and with the rounded
/// corner, which displaces the whole edge. Fitted to the cells of the table in README.md (measure_corners).
struct EdgeNoise {
  double variance_factor;            ///< For the correlation of neighbouring points or pixels.
  double cell_bias, cell_decay;      ///< Of the next but one cells: relative to the width of a cell.
  double corner_bias, corner_decay;  ///< Of the corner: relative to the blur.

  /// Standard deviation of the displacement, px, for the `blur` and the width of a `cell`, px.
  [[nodiscard]] double bias(double blur, double cell) const {
    const auto tail = [&](double distance, double decay) {
      return std::exp(-decay * (distance / blur) * (distance / blur));
    };
    return std::hypot(cell_bias * cell * tail(cell, cell_decay),
                      corner_bias * blur * tail(kCornerMargin_px, corner_decay));
  }
};
/// `blur` is Steepest::width_px.
constexpr EdgeNoise kTraceNoise{1.8, 0.6, 2.6, 0.035, 2.6};
/// `blur` is the fitted standard deviation.
constexpr EdgeNoise kFitNoise{1.2, 0.16, 0.23, 0.18, 0.77};
/// Largest half width of the searched band, px.
constexpr double kMaxHalfWidth_px = 20;

struct Steepest {
  double d = 0;
  double width_px = 0;  ///< Width of the edge: its intensity range divided by its steepest slope.
};

/// The middle of the steepest ascent (times `sign`) along `p0 + out * d`, |d| <= reach <= kMaxHalfWidth_px, if any: the
/// centroid of the gradient above kMinShareOfPeak of its maximum. The maximum itself has an error of 0.1 px, because
/// the samples interpolate pixels.
std::optional<Steepest> steepest(const LinearPicture& picture, Vector2d p0, Vector2d out, double reach, double sign) {
  constexpr double kStep = 0.5;
  constexpr std::size_t kGradientOffset = 2;  // Differences over 2 px: shorter is noisy, longer mixes the next cell.
  constexpr double kMinShareOfPeak = 0.7;     // Less mixes the next cell, more is noisy.
  constexpr auto kMaxHalf = static_cast<std::size_t>(kMaxHalfWidth_px / kStep);
  const std::size_t half = std::min(static_cast<std::size_t>(std::ceil(reach / kStep)), kMaxHalf);
  std::array<double, 2 * (kMaxHalf + kGradientOffset) + 1> buffer;
  const std::span<double> values = std::span(buffer).first(2 * (half + kGradientOffset) + 1);
  const double first = -kStep * static_cast<double>(half + kGradientOffset);
  if (!picture.along(p0 + out * first, out * kStep, values)) return std::nullopt;
  double best = 0;
  std::size_t where = 0;
  const auto gradient = [&](std::size_t i) {
    return sign * (values[i + kGradientOffset] - values[i - kGradientOffset]);
  };
  for (std::size_t i = kGradientOffset; i + kGradientOffset < values.size(); ++i)
    if (const double g = gradient(i); g > best) {
      best = g;
      where = i;
    }
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  if (best < kMinContrast * picture.step_at((*least + *most) / 2)) return std::nullopt;
  const double base = kMinShareOfPeak * best;
  double weights = best - base, moment = weights * static_cast<double>(where);
  const auto add = [&](std::size_t i) {
    const double weight = gradient(i) - base;
    if (!(weight > 0)) return false;
    weights += weight;
    moment += weight * static_cast<double>(i);
    return true;
  };
  for (std::size_t i = where; i > kGradientOffset && add(i - 1);) --i;
  for (std::size_t i = where; i + kGradientOffset + 1 < values.size() && add(i + 1);) ++i;
  return Steepest{first + moment / weights * kStep, 2 * kGradientOffset * kStep * (*most - *least) / best};
}

struct Sample {
  double t, d, value;
};

/// The pixels within `half` px of the edge; t = s / edge.end.
std::vector<Sample> band(const LinearPicture& picture, const Edge& edge, double half) {
  Vector2d low = edge.at(edge.begin), high = low;
  for (const double s : {edge.begin, (edge.begin + edge.end) / 2, edge.end})
    for (const double aside : {-half, half}) {
      const Vector2d p = edge.at(s) + edge.out * aside;
      low = low.cwiseMin(p).eval();
      high = high.cwiseMax(p).eval();
    }
  std::vector<Sample> out;
  for (int y = static_cast<int>(std::floor(low.y())) - 1; y <= static_cast<int>(std::ceil(high.y())) + 1; ++y)
    for (int x = static_cast<int>(std::floor(low.x())) - 1; x <= static_cast<int>(std::ceil(high.x())) + 1; ++x) {
      if (!picture.holds(x, y)) continue;
      const Vector2d p = Vector2d(x, y) - edge.origin;
      const double s = p.dot(edge.along), d = p.dot(edge.out);
      if (s >= edge.begin && s <= edge.end && std::abs(d - edge.offset(s)) <= half)
        out.push_back({s / edge.end, d, picture.at(x, y)});
    }
  return out;
}

/// Edge profile: a step convolved with a Gaussian and the area of a square pixel, with derivatives. The profile of a
/// pixel that is rotated against the edge is the convolution of two boxes: the wider is exact, the narrower is added to
/// the Gaussian by its variance.
class BlurredStep {
 public:
  BlurredStep(double sigma, Vector2d across)
      : width_(across.cwiseAbs().maxCoeff()), own_(sigma), sigma_(std::sqrt(sigma * sigma + small(across))) {}

  struct Value {
    double share, by_distance, by_sigma;
  };
  [[nodiscard]] Value at(double distance) const {
    // Shortcut for the many pixels far from the edge: beyond 6 sigma the share differs from 0 or 1 by 1e-9.
    if (const double beyond = std::abs(distance) - width_ / 2; beyond > 6 * sigma_)
      return {distance > 0 ? 1.0 : 0.0, 0, 0};
    const double a = (distance + width_ / 2) / sigma_, b = (distance - width_ / 2) / sigma_;
    const auto [fa, da] = normal_.at(a);
    const auto [fb, db] = normal_.at(b);
    return {sigma_ * (a * fa + da - b * fb - db) / width_, (fa - fb) / width_, (da - db) / width_ * own_ / sigma_};
  }

 private:
  static double small(Vector2d across) {
    const double w = across.cwiseAbs().minCoeff();
    return w * w / 12;
  }
  const NormalTable& normal_ = normal_table();
  double width_, own_, sigma_;
};

/// Parameters: curve (3), value inside, outside, blur sigma (px), relative illumination gradients along, across (1/px).
class EdgeModel {
 public:
  /// `rounding` is the standard deviation of the rounding of pixel values.
  EdgeModel(const Edge& edge, std::vector<Sample> samples, double rounding)
      : edge_(edge), samples_(std::move(samples)), rounding_(rounding) {}

  struct Sums {
    Normal normal = Normal::Zero();         ///< Normal equations: weighted J'J,
    Parameters right = Parameters::Zero();  ///< and the right-hand side, weighted J'r.
    double cost = 0, squares = 0, count = 0, rounding = 0;

    /// Estimated variance of one pixel, at least that of rounding.
    [[nodiscard]] double variance() const {
      return std::max(squares / std::max(count - kUnknown, 1.0), rounding * rounding);
    }
  };

  /// Sums at the parameters `at`. `scale` is the scale of Tukey's biweight, in pixel values; 0: all weights are 1.
  [[nodiscard]] Sums sums(const Parameters& at, double scale) {
    Sums out;
    out.rounding = rounding_;
    residuals_.clear();
    const BlurredStep blurred(at[5], edge_.out);
    const double step = at[4] - at[3];
    for (const Sample& s : samples_) {
      const BlurredStep::Value v = blurred.at(s.d - (at[0] + s.t * (at[1] + s.t * at[2])));
      const double even = at[3] + step * v.share, along = (s.t - 0.5) * edge_.end;
      const double light = 1 + at[6] * along + at[7] * s.d, moved = -step * v.by_distance * light;
      Parameters slope;
      slope << moved, moved * s.t, moved * s.t * s.t, (1 - v.share) * light, v.share * light, step * v.by_sigma * light,
          even * along, even * s.d;
      const double r = s.value - even * light;
      residuals_.push_back(std::abs(r));
      // Tukey's biweight and its loss.
      double w = 1, loss = r * r;
      if (scale > 0) {
        const double cut = 4.685 * scale, q = std::min(1.0, r * r / (cut * cut));
        w = (1 - q) * (1 - q);
        loss = cut * cut / 3 * (1 - (1 - q) * w);
      }
      out.normal += w * slope * slope.transpose();
      out.right += w * r * slope;
      out.cost += loss;
      out.squares += w * r * r;
      out.count += w;
    }
    return out;
  }

  /// Upper median of the absolute residuals of the last call of sums().
  [[nodiscard]] double median_residual() const { return upper_quantile(std::vector(residuals_), 0.5); }

 private:
  const Edge& edge_;
  std::vector<Sample> samples_;
  std::vector<double> residuals_;
  double rounding_;
};

/// Start of the fit: mean values on both sides of the edge and a blur of 0.7 px; nullopt if there are too few pixels.
std::optional<Parameters> first_guess(const Edge& edge, const std::vector<Sample>& samples, double half) {
  double inside = 0, outside = 0;
  int insides = 0, outsides = 0;
  for (const Sample& s : samples) {
    const double off = s.d - edge.offset(s.t * edge.end);
    if (off < -half / 2) {
      inside += s.value;
      ++insides;
    } else if (off > half / 2) {
      outside += s.value;
      ++outsides;
    }
  }
  if (samples.size() < 12 || insides < 2 || outsides < 2) return std::nullopt;
  Parameters x;
  x << edge.curve, inside / insides, outside / outsides, 0.7, 0, 0;
  return x;
}

}  // namespace

bool trace_edge(const LinearPicture& picture, Edge& edge, double reach, double sign) {
  struct Point {
    double t, d, width_px;
  };
  std::array<Point, kMaxPoints> points;
  std::size_t count = 0;
  const int steps = std::clamp(static_cast<int>(edge.end - edge.begin), 4, static_cast<int>(kMaxPoints) - 1);
  for (int i = 0; i <= steps; ++i) {
    const double s = edge.begin + (edge.end - edge.begin) * i / steps;
    if (const auto d = steepest(picture, edge.origin + edge.along * s, edge.out, reach, sign))
      points[count++] = {s / edge.end, d->d, d->width_px};
  }
  if (count < 4 || 2 * count < static_cast<std::size_t>(steps)) return false;
  const double bend = bend_deviation(picture, edge.end);
  Eigen::Vector3d curve = Eigen::Vector3d::Zero();
  Eigen::Matrix3d normal;
  double scale = reach, squares = 0, weights = 0;
  for (int pass = 0; pass < 6; ++pass) {
    normal.setZero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    normal(2, 2) = kPointDeviation * kPointDeviation / (bend * bend);
    double sum = 0;
    squares = weights = 0;
    for (const auto& [t, d, width_px] : std::span(points).first(count)) {
      const Eigen::Vector3d row(1, t, t * t);
      const double r = d - row.dot(curve);
      const double w = pass == 0 ? 1 : 1 / (1 + (r / scale) * (r / scale));
      normal += w * row * row.transpose();
      right += w * row * d;
      sum += w * std::abs(r);
      squares += w * r * r;
      weights += w;
    }
    curve = normal.ldlt().solve(right);
    if (pass > 0) scale = std::max(0.25, 1.5 * sum / weights);
  }
  if (!curve.allFinite()) return false;
  edge.curve = curve;
  const double variance =
      std::max(squares / std::max(weights - 3, 1.0), kMinScatter_px * kMinScatter_px) * kTraceNoise.variance_factor;
  edge.covariance = variance * normal.inverse();
  const auto middle = points.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(points.begin(), middle, points.begin() + static_cast<std::ptrdiff_t>(count),
                   [](const Point& a, const Point& b) { return a.width_px < b.width_px; });
  const double bias = kTraceNoise.bias(middle->width_px, edge.cell);
  edge.covariance(0, 0) += bias * bias;
  return true;
}

/// Levenberg-Marquardt, first with equal weights, then twice with Tukey's biweight.
bool fit(const LinearPicture& picture, Edge& edge, double sign) {
  const double half = std::clamp(0.6 * edge.cell, 1.2, 5.0);
  const std::vector<Sample> samples = band(picture, edge, half);
  const std::optional<Parameters> guess = first_guess(edge, samples, half);
  if (!guess) return false;
  Parameters x = *guess;
  const double bend = bend_deviation(picture, edge.end);
  const double step = picture.step_at((x[3] + x[4]) / 2);
  EdgeModel model(edge, samples, kRounding * step);
  EdgeModel::Sums here;
  for (int round = 0; round < 3; ++round) {
    double scale = 0;
    // The median residual measures the noise of the flat areas; the second term allows for model error on the slope.
    if (round > 0) scale = std::max(1.4826 * model.median_residual(), step + 0.02 * std::abs(x[4] - x[3]));
    here = model.sums(x, scale);
    double damping = 1e-3;
    for (int i = 0; i < 10; ++i) {
      Normal damped = here.normal;
      Parameters right = here.right;
      const auto add_zero_prior = [&](int k, double deviation) {
        const double weight = here.variance() / (deviation * deviation);
        damped(k, k) += weight;
        right[k] -= weight * x[k];
      };
      add_zero_prior(2, bend);
      add_zero_prior(6, kIlluminationGradient);
      add_zero_prior(7, kIlluminationGradientAcross);
      damped.diagonal() *= 1 + damping;
      const Parameters change = damped.ldlt().solve(right);
      if (!change.allFinite()) return false;
      Parameters next = x + change;
      next[5] = std::clamp(next[5], 0.15, half);
      const EdgeModel::Sums there = model.sums(next, scale);
      if (there.cost <= here.cost * (1 + 1e-6)) {
        x = next;
        here = there;
        damping = std::max(damping / 10, 1e-9);
        if (change.head<3>().cwiseAbs().maxCoeff() < 1e-4) break;
      } else {
        damping *= 10;
        if (damping > 1e6) break;
      }
    }
  }
  if (here.count < 10) return false;
  const double contrast = sign * (x[4] - x[3]);
  if (contrast < kMinContrast * step || contrast < 2 * std::sqrt(here.variance())) return false;
  if ((x.head<3>() - edge.curve).cwiseAbs().maxCoeff() > 2 * half) return false;
  Normal information = here.normal / here.variance();
  information(2, 2) += 1 / (bend * bend);
  information(6, 6) += 1 / (kIlluminationGradient * kIlluminationGradient);
  information(7, 7) += 1 / (kIlluminationGradientAcross * kIlluminationGradientAcross);
  const Normal covariance = information.ldlt().solve(Normal::Identity());
  if (!covariance.allFinite()) return false;
  edge.curve = x.head<3>();
  edge.covariance = kFitNoise.variance_factor * covariance.topLeftCorner<3, 3>();
  const double bias = kFitNoise.bias(x[5], edge.cell);
  edge.covariance(0, 0) += bias * bias;
  return true;
}

}  // namespace lightwell
