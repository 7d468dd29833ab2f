#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/geometry.hpp>
#include <lightwell/lobes.hpp>
#include <lightwell/reconstruction.hpp>

#include "gauss_legendre.hpp"

namespace lightwell {
namespace {

constexpr int kCount = sh_count(kMaxBand);
using Coefficients = std::array<double, kCount>;
using Factors = std::array<double, kMaxBand + 1>;

/// Bands that enter the maximum entropy estimate: higher ones cost more time than they improve it.
constexpr int kEstimateBand = 4;
constexpr int kMaxUnknowns = sh_count(kEstimateBand);
/// Variance of a coefficient, relative to the mean squared: regularises coefficients that, after rounding, no positive
/// distribution has.
constexpr double kVariance = 1e-3;
constexpr int kMaxIterations = 20;
/// Convergence threshold: expected decrease of the potential, for a distribution of integral 1. Far below a visible
/// difference; the last Newton step converges quadratically below it.
constexpr double kConverged = 1e-7;
/// Limit of the exponent of the distribution in a step.
constexpr double kMaxExponent = 40;

/// Floor of the windowed radiance, as a fraction of the local mean.
constexpr double kMinLocalMeanFraction = 0.1;
/// A band below this fraction of band 0 counts as not sent: a rotation in single precision turns its zeros into that.
constexpr double kRounding = 1e-5;
/// A channel whose mean is below this fraction of the brightest channel's is rounding noise and is ignored.
constexpr double kMinChannelRatio = 1e-3;
/// t = kBlurUnit s / (1 - s), s in [0, 1] by bisection.
constexpr double kBlurUnit = 0.1, kMaxBlur = 100;
constexpr int kBisections = 11;
constexpr int kDirections = 512;

/// Quadrature that is exact up to band 19.
struct EstimateGrid {
  static constexpr int kRows = 10, kColumns = 20, kNodes = kRows * kColumns;
  std::array<double, kNodes> weight;
  std::array<Coefficients, kNodes> y;

  static const EstimateGrid& get() {
    static const EstimateGrid grid = [] {
      EstimateGrid g;
      std::size_t n = 0;
      for_each_sphere_node(kRows, kColumns, 0.5, [&](Vec3d direction, double weight) {
        g.weight[n] = weight;
        sh_basis(kMaxBand, direction, g.y[n++]);
      });
      return g;
    }();
    return grid;
  }
};

using Row = std::array<double, kDirections>;

/// Values of the basis functions on an equal-area spiral of directions, at which ringing is detected.
const std::array<Row, kCount>& window_directions() {
  static const auto directions = [] {
    std::array<Row, kCount> out;
    Coefficients y;
    for (int i = 0; i < kDirections; ++i) {
      sh_basis(kMaxBand, fibonacci_direction(i, kDirections), y);
      for (std::size_t f = 0; f < y.size(); ++f) out[f][static_cast<std::size_t>(i)] = y[f];
    }
    return out;
  }();
  return directions;
}

double coefficient(const RadianceSh& sh, int i, int k) {
  return static_cast<double>(sh.c[static_cast<std::size_t>(i)][k]);
}

/// Mean over the sphere; 0 if the channel is not a valid radiance.
double mean_of(const RadianceSh& sh, int k) {
  double sum = 0;
  for (int i = 0; i < sh.count(); ++i) sum += coefficient(sh, i, k);
  const double mean = coefficient(sh, 0, k) * std::sqrt(0.25 / std::numbers::pi);
  return mean > 0 && std::isfinite(sum) ? mean : 0;
}

std::array<bool, kMaxBand + 1> sent_bands(const RadianceSh& sh) {
  std::array<bool, kMaxBand + 1> sent{};
  for (int l = 0, i = 0; l <= sh.band; ++l)
    for (; i < sh_count(l); ++i)
      for (int k = 0; k < 3; ++k)
        if (std::abs(coefficient(sh, i, k)) > kRounding * std::abs(coefficient(sh, 0, k)))
          sent[static_cast<std::size_t>(l)] = true;
  return sent;
}

/// Maximum entropy by Newton's method on the dual problem, the convex potential
/// integral exp(sum lambda_i Y_i) - sum lambda_i c_i + variance/2 sum lambda_i², whose gradient is the error of the
/// moments.
class MaxEntropy {
 public:
  explicit MaxEntropy(const std::array<bool, kMaxBand + 1>& sent) : grid_(EstimateGrid::get()) {
    for (int l = 0; l <= kEstimateBand; ++l)
      for (int i = l * l; i < sh_count(l); ++i)
        if (sent[static_cast<std::size_t>(l)]) index_[count_++] = static_cast<std::size_t>(i);
    for (std::size_t n = 0; n < y_.size(); ++n)
      for (std::size_t a = 0; a < count_; ++a) y_[n][a] = grid_.y[n][index_[a]];
    lambda_[0] = -std::log(4 * std::numbers::pi) * std::sqrt(4 * std::numbers::pi);
  }

  /// Coefficients of all bands for a channel with that mean, scaled to integral 1. Starts at the last channel's
  /// solution.
  Coefficients estimate(const RadianceSh& sh, int k, double mean) {
    moments(sh, k, mean);
    double potential = evaluate(lambda_);
    for (int step = 0; step < kMaxIterations; ++step) {
      const double decrement = newton_step();
      if (!(decrement > kConverged)) break;
      double share = 1;
      std::array<double, kMaxUnknowns> next{};
      for (;; share /= 2) {
        for (std::size_t a = 0; a < count_; ++a) next[a] = lambda_[a] - share * step_[a];
        const double there = evaluate(next);
        if (there < potential - 0.1 * share * decrement || share < 1e-4) {
          potential = there;
          break;
        }
      }
      lambda_ = next;
    }
    Coefficients out{};
    for (std::size_t n = 0; n < y_.size(); ++n)
      for (std::size_t i = 0; i < kCount; ++i) out[i] += flux_[n] * grid_.y[n][i];
    return out;
  }

 private:
  /// Scales to mean 1/(4 pi) and limits each band to what a distribution can have: sum of squares below (2l+1) times
  /// that of band 0.
  void moments(const RadianceSh& sh, int k, double mean) {
    const double unit = 1 / (4 * std::numbers::pi * mean);
    std::array<double, kMaxBand + 1> square{};
    const auto band = [&](std::size_t a) {
      return static_cast<std::size_t>(std::sqrt(static_cast<double>(index_[a])));
    };
    for (std::size_t a = 0; a < count_; ++a) {
      target_[a] = coefficient(sh, static_cast<int>(index_[a]), k) * unit;
      square[band(a)] += target_[a] * target_[a];
    }
    for (std::size_t a = 1; a < count_; ++a) {
      const double most = 0.95 * std::sqrt((2 * static_cast<double>(band(a)) + 1) * square[0]);
      target_[a] *= std::min(1.0, most / std::sqrt(std::max(square[band(a)], 1e-30)));
    }
  }

  /// Computes the potential, and flux_ at the nodes.
  double evaluate(const std::array<double, kMaxUnknowns>& lambda) {
    double sum = 0;
    for (std::size_t n = 0; n < y_.size(); ++n) {
      double exponent = 0;
      for (std::size_t a = 0; a < count_; ++a) exponent += lambda[a] * y_[n][a];
      flux_[n] = grid_.weight[n] * std::exp(std::min(exponent, kMaxExponent));
      sum += flux_[n];
    }
    for (std::size_t a = 0; a < count_; ++a)
      sum += lambda[a] * ((a > 0 ? kVariance / 2 * lambda[a] / (4 * std::numbers::pi) : 0) - target_[a]);
    return sum;
  }

  /// Computes the Newton step by Cholesky decomposition; returns the decrease of the potential along it to first order.
  double newton_step() {
    std::array<std::array<double, kMaxUnknowns>, kMaxUnknowns> h{};
    std::array<double, kMaxUnknowns> g{};
    for (std::size_t n = 0; n < y_.size(); ++n)
      for (std::size_t a = 0; a < count_; ++a) {
        const double q = flux_[n] * y_[n][a];
        g[a] += q;
        for (std::size_t b = 0; b <= a; ++b) h[a][b] += q * y_[n][b];
      }
    for (std::size_t a = 0; a < count_; ++a) {
      g[a] -= target_[a];
      h[a][a] += 1e-12;
      if (a == 0) continue;
      g[a] += kVariance * lambda_[a] / (4 * std::numbers::pi);
      h[a][a] += kVariance / (4 * std::numbers::pi);
    }
    step_ = g;
    for (std::size_t j = 0; j < count_; ++j) {
      for (std::size_t k = 0; k < j; ++k) h[j][j] -= h[j][k] * h[j][k];
      h[j][j] = std::sqrt(std::max(h[j][j], 1e-12));
      for (std::size_t i = j + 1; i < count_; ++i) {
        for (std::size_t k = 0; k < j; ++k) h[i][j] -= h[i][k] * h[j][k];
        h[i][j] /= h[j][j];
      }
    }
    for (std::size_t i = 0; i < count_; ++i) {
      for (std::size_t k = 0; k < i; ++k) step_[i] -= h[i][k] * step_[k];
      step_[i] /= h[i][i];
    }
    for (std::size_t i = count_; i-- > 0;) {
      for (std::size_t k = i + 1; k < count_; ++k) step_[i] -= h[k][i] * step_[k];
      step_[i] /= h[i][i];
    }
    double decrement = 0;
    for (std::size_t a = 0; a < count_; ++a) decrement += g[a] * step_[a];
    return decrement;
  }

  const EstimateGrid& grid_;
  std::size_t count_ = 0;
  std::array<std::size_t, kMaxUnknowns> index_{};
  std::array<std::array<double, kMaxUnknowns>, EstimateGrid::kNodes> y_;
  std::array<double, EstimateGrid::kNodes> flux_{};  ///< Radiance times solid angle.
  std::array<double, kMaxUnknowns> target_{}, lambda_{}, step_{};
};

RadianceSh completed(const RadianceSh& sh) {
  const auto sent = sent_bands(sh);
  RadianceSh out = sh;
  std::fill(out.c.begin() + sh.count(), out.c.end(), Radiance{});
  // With only band 0, or with all bands, there is nothing to estimate.
  const bool known = std::any_of(sent.begin() + 1, sent.begin() + kEstimateBand + 1, [](bool s) { return s; });
  if (!known || std::all_of(sent.begin(), sent.end(), [](bool s) { return s; })) return out;
  out.band = kMaxBand;
  MaxEntropy entropy(sent);
  for (int k = 0; k < 3; ++k) {
    const double mean = mean_of(sh, k);
    if (!(mean > 0)) continue;
    const Coefficients all = entropy.estimate(sh, k, mean);
    for (int l = 1; l <= kMaxBand; ++l)
      for (int i = l * l; i < sh_count(l) && !sent[static_cast<std::size_t>(l)]; ++i)
        out.c[static_cast<std::size_t>(i)][k] =
            static_cast<float>(4 * std::numbers::pi * mean * all[static_cast<std::size_t>(i)]);
  }
  return out;
}

/// The window exp(-t l(l+1)).
Factors window(double t) {
  const double q = std::exp(-2 * t);
  Factors out;
  out[0] = 1;
  double step = 1;
  for (std::size_t l = 1; l < out.size(); ++l) out[l] = out[l - 1] * (step *= q);
  return out;
}

/// Legendre coefficients of ((1 + x)/2)^6, the narrowest positive kernel of this form without bands above 6.
Factors positive_kernel() {
  Factors out;
  out[0] = 1;
  for (std::size_t l = 1; l < out.size(); ++l)
    out[l] = out[l - 1] * static_cast<double>(kMaxBand + 1 - l) / static_cast<double>(kMaxBand + 1 + l);
  return out;
}

const std::array<Factors, RadianceReconstruction::kKnots>& lobes_at_knots() {
  static const auto lobes = [] {
    std::array<Factors, RadianceReconstruction::kKnots> out;
    out[0].fill(1);
    for (std::size_t k = 1; k < out.size(); ++k)
      out[k] = GgxLobe(static_cast<double>(k) / (RadianceReconstruction::kKnots - 1)).coefficients();
    return out;
  }();
  return lobes;
}

/// Contribution of each band at the directions of the spiral, for the channels that are not ignored, relative to their
/// mean.
class WindowSearch {
 public:
  explicit WindowSearch(const RadianceSh& sh) : bands_(static_cast<std::size_t>(sh.band) + 1) {
    double brightest = 0;
    for (int k = 0; k < 3; ++k) brightest = std::max(brightest, mean_of(sh, k));
    for (int k = 0; k < 3; ++k) {
      const double mean = mean_of(sh, k);
      if (!(mean > kMinChannelRatio * brightest)) continue;
      Channel& channel = channels_[count_++];
      for (int l = 0, i = 0; l <= sh.band; ++l) {
        Row& row = channel[static_cast<std::size_t>(l)] = {};
        for (; i < sh_count(l); ++i) {
          const double c = coefficient(sh, i, k) / mean;
          const Row& y = window_directions()[static_cast<std::size_t>(i)];
          for (std::size_t n = 0; n < kDirections; ++n) row[n] += c * y[n];
        }
      }
    }
  }

  /// The smallest t, at least `least`, whose window keeps the radiance under that lobe above the floor everywhere.
  double blur(const Factors& lobe, double least) {
    Factors around = positive_kernel();
    for (std::size_t l = 0; l < lobe.size(); ++l) around[l] *= lobe[l];
    for (std::size_t k = 0; k < count_; ++k) {
      weigh(channels_[k], around, 0, kDirections, floor_[k]);
      for (double& f : floor_[k]) f = kMinLocalMeanFraction * std::clamp(f, 0.0, 1.0);
    }
    if (keeps_floor(lobe, least)) return least;
    double low = least / (least + kBlurUnit), high = 1;
    for (int step = 0; step < kBisections; ++step) {
      const double s = 0.5 * (low + high);
      (keeps_floor(lobe, kBlurUnit * s / (1 - s)) ? high : low) = s;
    }
    return high < 1 ? kBlurUnit * high / (1 - high) : kMaxBlur;
  }

 private:
  using Channel = std::array<Row, kMaxBand + 1>;

  void weigh(const Channel& channel, const Factors& factor, std::size_t from, std::size_t to, Row& out) const {
    for (std::size_t n = from; n < to; ++n) out[n] = factor[0] * channel[0][n];
    for (std::size_t l = 1; l < bands_; ++l)
      for (std::size_t n = from; n < to; ++n) out[n] += factor[l] * channel[l][n];
  }

  [[nodiscard]] bool keeps_floor(const Factors& lobe, double t) const {
    constexpr std::size_t kBlock = 64;
    Factors factor = window(t);
    for (std::size_t l = 0; l < lobe.size(); ++l) factor[l] *= lobe[l];
    Row value;
    for (std::size_t k = 0; k < count_; ++k)
      for (std::size_t from = 0; from < kDirections; from += kBlock) {
        weigh(channels_[k], factor, from, from + kBlock, value);
        for (std::size_t n = from; n < from + kBlock; ++n)
          if (value[n] < floor_[k][n]) return false;
      }
    return true;
  }

  std::size_t bands_, count_ = 0;
  std::array<Channel, 3> channels_;
  std::array<Row, 3> floor_;
};

}  // namespace

RadianceReconstruction reconstruct(const RadianceSh& sh) {
  RadianceReconstruction out;
  out.sh = completed(sh);
  if (out.sh.band == 0) return out;
  WindowSearch search(out.sh);
  double t = 0;
  for (std::size_t k = out.blur.size(); k-- > 0;) {
    t = search.blur(lobes_at_knots()[k], t);
    out.blur[k] = static_cast<float>(t);
  }
  return out;
}

RadianceReconstruction rotated(const RadianceReconstruction& reconstruction, Quat q) {
  return {rotated(reconstruction.sh, q), reconstruction.blur};
}

RadianceReconstruction interpolated(const RadianceReconstruction& a, const RadianceReconstruction& b, float f) {
  RadianceReconstruction out;
  out.sh.band = std::max(a.sh.band, b.sh.band);
  for (std::size_t i = 0; i < out.sh.c.size(); ++i) out.sh.c[i] = a.sh.c[i] * (1 - f) + b.sh.c[i] * f;
  for (std::size_t k = 0; k < out.blur.size(); ++k) out.blur[k] = a.blur[k] * (1 - f) + b.blur[k] * f;
  return out;
}

Radiance radiance_at(const RadianceReconstruction& reconstruction, Vec3f d, double roughness,
                     const std::array<double, kMaxBand + 1>& lobe) {
  constexpr int kLast = RadianceReconstruction::kKnots - 1;
  const double at = std::clamp(roughness, 0.0, 1.0) * kLast;
  const auto knot = static_cast<std::size_t>(std::min(static_cast<int>(at), kLast - 1));
  const auto low = static_cast<double>(knot);
  const double share = (at * at - low * low) / (2 * low + 1);
  const auto& blur = reconstruction.blur;
  const double t = static_cast<double>(blur[knot]) * (1 - share) + static_cast<double>(blur[knot + 1]) * share;
  const Factors factor = window(t);
  RadianceSh shown;
  shown.band = reconstruction.sh.band;
  for (int l = 0, i = 0; l <= shown.band; ++l) {
    const auto k = static_cast<float>(factor[static_cast<std::size_t>(l)] * lobe[static_cast<std::size_t>(l)]);
    for (; i < sh_count(l); ++i)
      shown.c[static_cast<std::size_t>(i)] = reconstruction.sh.c[static_cast<std::size_t>(i)] * k;
  }
  const Radiance l = evaluate(shown, d);
  // The order of the comparison maps NaN to 0.
  return {std::max(0.0F, l.r), std::max(0.0F, l.g), std::max(0.0F, l.b)};
}

}  // namespace lightwell
