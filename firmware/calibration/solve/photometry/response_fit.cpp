#include "calibration/solve/photometry/response_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

using Samples = std::span<const ResponseSample>;

/// Prior uncertainty of the base curve's gamma near dark.
constexpr double kGammaDifference = 0.2;
/// Smallest weight in the smoothness penalty, at the lowest knots; it is about 1 at the highest.
constexpr double kMinStiffness = 0.0025;

/// Calls `each` with first and end index of each pixel's samples.
template <class Each>
void each_pixel(Samples samples, const Each& each) {
  for (std::size_t first = 0, end = 0; first < samples.size(); first = end) {
    while (end < samples.size() && samples[end].pixel == samples[first].pixel) ++end;
    each(first, end);
  }
}

std::vector<double> logs_of(Samples samples, const LogCurve& curve) {
  constexpr double kStep = 1e-4;
  std::vector<double> logs;
  logs.reserve(samples.size());
  for (const ResponseSample& s : samples) {
    double log = curve(s.expected);
    if (s.value != s.expected)
      log += (curve(s.expected + kStep) - curve(s.expected - kStep)) / (2 * kStep) * (s.value - s.expected);
    logs.push_back(log - s.log_exposure);
  }
  return logs;
}

std::vector<double> median_light(Samples samples, std::size_t pixels, const std::vector<double>& logs) {
  std::vector<double> light(pixels), hats;
  each_pixel(samples, [&](std::size_t first, std::size_t end) {
    hats.clear();
    for (std::size_t k = first; k < end; ++k) hats.push_back(samples[k].hat);
    light[samples[first].pixel] = weighted_median(std::span(logs).subspan(first, end - first), hats);
  });
  return light;
}

/// Sums over samples after subtracting each pixel's weighted mean, which eliminates its light.
struct CentredSums {
  Eigen::MatrixXd normal;    ///< J' W J
  Eigen::VectorXd gradient;  ///< J' W y
  double squares = 0;        ///< y' W y
  Eigen::MatrixXd meat;      ///< Sum over pixels of the outer product of their J' W y.
  Eigen::MatrixXd exposure;  ///< J' W summed by exposure: effect of an error of that exposure, common to all pixels.
};

CentredSums centred_sums(Samples samples, const Eigen::MatrixXd& jacobian, const std::vector<double>& y,
                         const std::vector<double>& weight) {
  const Eigen::Index n = jacobian.cols();
  std::size_t exposures = 0;
  for (const ResponseSample& s : samples) exposures = std::max(exposures, s.exposure + 1);
  CentredSums sums{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n), 0, Eigen::MatrixXd::Zero(n, n),
                   Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(exposures))};
  // Rows are sparse: summing the non-zero entries and correcting for the means is ten times as fast as centring rows.
  std::vector<Eigen::Index> nonzero;
  each_pixel(samples, [&](std::size_t first, std::size_t end) {
    double total = 0, mean_y = 0;
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(n), score = Eigen::VectorXd::Zero(n);
    for (std::size_t k = first; k < end; ++k) {
      total += weight[k];
      mean += weight[k] * jacobian.row(static_cast<Eigen::Index>(k)).transpose();
      mean_y += weight[k] * y[k];
    }
    if (!(total > 0)) return;
    mean /= total;
    mean_y /= total;
    for (std::size_t k = first; k < end; ++k) {
      const auto row = jacobian.row(static_cast<Eigen::Index>(k));
      const double centred = y[k] - mean_y;
      nonzero.clear();
      for (Eigen::Index i = 0; i < n; ++i)
        if (row(i) != 0) nonzero.push_back(i);
      for (const Eigen::Index i : nonzero) {
        for (const Eigen::Index j : nonzero) sums.normal(i, j) += weight[k] * row(i) * row(j);
        score(i) += weight[k] * centred * row(i);
      }
      sums.exposure.col(static_cast<Eigen::Index>(samples[k].exposure)) += weight[k] * (row.transpose() - mean);
      sums.squares += weight[k] * centred * centred;
    }
    sums.normal.noalias() -= total * mean * mean.transpose();
    sums.gradient += score;
    sums.meat.noalias() += score * score.transpose();
  });
  return sums;
}

/// Ratio of the mean curvature of Tukey's loss to the mean weight (Huber 1981, section 7.6).
double curvature_share(Samples samples, const ResponseFit& fit) {
  double slope = 0, weight = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double hat = samples[k].hat;
    slope += hat * hat * tukey_slope(hat * fit.residual[k] / fit.scale);
    weight += fit.weight[k];
  }
  return weight > 0 ? std::clamp(slope / weight, 0.2, 1.0) : 1;
}

/// Fractional knot index among the evenly spaced knots 0 to `last`.
double knot_position(double share, std::size_t last) { return std::clamp(share, 0.0, 1.0) * static_cast<double>(last); }

/// Number of samples with weight, and degrees of freedom after estimating each pixel's light.
struct Counts {
  double all = 0, free = 0;
};

Counts counts_of(Samples samples) {
  Counts out;
  each_pixel(samples, [&](std::size_t first, std::size_t end) {
    double own = 0;
    for (std::size_t k = first; k < end; ++k) own += samples[k].hat > 0 ? 1 : 0;
    out.all += own;
    out.free += std::max(0.0, own - 1);
  });
  return out;
}

}  // namespace

double absolute_loss(Samples samples, std::size_t pixels, const LogCurve& curve) {
  const std::vector<double> logs = logs_of(samples, curve);
  const std::vector<double> light = median_light(samples, pixels, logs);
  double sum = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) sum += samples[k].hat * std::abs(logs[k] - light[samples[k].pixel]);
  return sum;
}

ResponseFit fit_light(Samples samples, std::size_t pixels, const LogCurve& curve, double scale, double min_scale) {
  const std::vector<double> logs = logs_of(samples, curve);
  ResponseFit fit;
  fit.log_light = median_light(samples, pixels, logs);
  fit.residual.resize(samples.size());
  fit.weight.resize(samples.size());
  std::vector<double> scaled(samples.size()), counted;
  // Correct for the estimated light of each pixel, which makes residuals smaller than the noise.
  const Counts counts = counts_of(samples);
  const double lost = std::sqrt(counts.all / std::max(1.0, counts.free));
  const auto weigh = [&] {
    counted.clear();
    for (std::size_t k = 0; k < samples.size(); ++k) {
      fit.residual[k] = logs[k] - fit.log_light[samples[k].pixel];
      scaled[k] = samples[k].hat * fit.residual[k];
      if (samples[k].hat > 0) counted.push_back(scaled[k]);
    }
    fit.scale = scale > 0 ? scale : std::max(min_scale, lost * scale_about_zero(counted));
    for (std::size_t k = 0; k < samples.size(); ++k)
      fit.weight[k] = samples[k].hat * samples[k].hat * tukey_weight(scaled[k] / fit.scale);
  };
  for (int pass = 0; pass < 20; ++pass) {
    weigh();
    each_pixel(samples, [&](std::size_t first, std::size_t end) {
      double sum = 0, total = 0;
      for (std::size_t k = first; k < end; ++k) {
        sum += fit.weight[k] * logs[k];
        total += fit.weight[k];
      }
      if (total > 0) fit.log_light[samples[first].pixel] = sum / total;
    });
  }
  weigh();
  for (const double u : scaled) fit.loss += 2 * tukey_loss(u / fit.scale);
  return fit;
}

LogCurve gamma_curve(double gamma, double dark) {
  const double black = dark > 0 ? std::pow(dark, gamma) : 0;
  return [gamma, black](double v) { return std::log(std::max(1e-12, (std::pow(v, gamma) - black) / (1 - black))); };
}

GammaFit fit_gamma(Samples samples, std::size_t pixels, double dark, double min_scale, double exposure_deviation) {
  constexpr double kMinGamma = 0.2, kMaxGamma = 6;
  GammaFit out;
  double best = -1;
  for (int i = 0; i <= 40; ++i) {
    const double gamma = kMinGamma * std::pow(kMaxGamma / kMinGamma, i / 40.0);
    const double loss = absolute_loss(samples, pixels, gamma_curve(gamma, dark));
    if (best >= 0 && loss >= best) continue;
    best = loss;
    out.gamma = gamma;
  }
  const auto slope_at = [&](double gamma) {
    Eigen::MatrixXd slope(static_cast<Eigen::Index>(samples.size()), 1);
    const double step = 1e-5 * gamma;
    const LogCurve above = gamma_curve(gamma + step, dark), below = gamma_curve(gamma - step, dark);
    for (std::size_t k = 0; k < samples.size(); ++k)
      slope(static_cast<Eigen::Index>(k), 0) = (above(samples[k].expected) - below(samples[k].expected)) / (2 * step);
    return slope;
  };
  for (int pass = 0; pass < 12; ++pass) {
    out.fit = fit_light(samples, pixels, gamma_curve(out.gamma, dark), 0, min_scale);
    const CentredSums sums = centred_sums(samples, slope_at(out.gamma), out.fit.residual, out.fit.weight);
    if (!(sums.normal(0, 0) > 0)) break;
    const double step = -sums.gradient(0) / sums.normal(0, 0);
    out.gamma = std::clamp(out.gamma + std::clamp(step, -0.3, 0.3), kMinGamma, kMaxGamma);
    if (std::abs(step) < 1e-9) break;
  }
  out.fit = fit_light(samples, pixels, gamma_curve(out.gamma, dark), 0, min_scale);
  const CentredSums sums = centred_sums(samples, slope_at(out.gamma), out.fit.residual, out.fit.weight);
  const double curvature = curvature_share(samples, out.fit) * sums.normal(0, 0);
  const double shared = exposure_deviation * exposure_deviation * sums.exposure.squaredNorm();
  out.variance = curvature > 0 ? (sums.meat(0, 0) + shared) / (curvature * curvature) : 0;
  return out;
}

double departure_at(const DepartureFit& fit, double value) {
  const auto last = fit.knots.size() - 1;
  const double at = knot_position((value - fit.knots.front()) / (fit.knots.back() - fit.knots.front()), last);
  const auto i = std::min(static_cast<std::size_t>(at), last - 1);
  const double share = at - static_cast<double>(i);
  const auto k = static_cast<Eigen::Index>(i);
  return fit.departure(k) * (1 - share) + fit.departure(k + 1) * share;
}

DepartureFit fit_departure(Samples samples, std::size_t pixels, const LogCurve& base, double dark, int knots,
                           double min_scale, double exposure_deviation, const Eigen::VectorXd& start) {
  DepartureFit out;
  for (int i = 0; i < knots; ++i) out.knots.push_back(dark + (1 - dark) * i / (knots - 1));
  out.departure = start.size() == knots ? start : Eigen::VectorXd::Zero(knots);
  const Eigen::Index n = knots - 1;  // The last knot is full scale, where ln x is 0.

  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(samples.size()), n);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double at = knot_position((samples[k].expected - dark) / (1 - dark), static_cast<std::size_t>(n));
    const Eigen::Index i = std::min(static_cast<Eigen::Index>(at), n - 1);
    const double share = at - static_cast<double>(i);
    basis(static_cast<Eigen::Index>(k), i) = 1 - share;
    if (i + 1 < n) basis(static_cast<Eigen::Index>(k), i + 1) = share;
  }
  // Penalty on third differences, so that the curve is extrapolated with constant curvature; the second differences of
  // the paper would extrapolate linearly. The weight is the square of the value instead of the hat, which vanishes at
  // the ends, where smoothness is needed most: towards dark the logarithms of two curves differ like that of the value.
  constexpr std::array<double, 4> kDifference{-1, 3, -3, 1};
  Eigen::MatrixXd bend = Eigen::MatrixXd::Zero(knots - 3, n);
  for (Eigen::Index i = 0; i < knots - 3; ++i)
    for (Eigen::Index k = 0; k < 4 && i + k < n; ++k) {
      const double share = (static_cast<double>(i) + 1.5) / static_cast<double>(n);
      bend(i, i + k) = std::max(share * share, kMinStiffness) * kDifference[static_cast<std::size_t>(k)];
    }
  const Eigen::MatrixXd penalty = bend.transpose() * bend;
  const auto rank = static_cast<double>(knots - 3);
  const double freedom = std::max(2.0, counts_of(samples).free - 2);

  std::vector<double> plain(samples.size());  // Residuals without a departure.
  Eigen::LDLT<Eigen::MatrixXd> solved;
  Eigen::MatrixXd normal;
  double stiffness = 0, variance = 0;
  for (int pass = 0; pass < 15; ++pass) {
    const LogCurve curve = [&](double v) { return base(v) + departure_at(out, v); };
    out.fit = fit_light(samples, pixels, curve, 0, min_scale);
    const Eigen::VectorXd departed = basis * out.departure.head(n);
    for (std::size_t k = 0; k < samples.size(); ++k)
      plain[k] = out.fit.residual[k] - departed(static_cast<Eigen::Index>(k));
    const CentredSums sums = centred_sums(samples, basis, plain, out.fit.weight);
    normal = sums.normal;
    const double unit = normal.trace() / penalty.trace();
    double best = 0;
    for (int i = 0; i <= 24; ++i) {
      const double tried = unit * std::pow(10.0, -5 + i / 2.5);
      const Eigen::LDLT<Eigen::MatrixXd> factor(normal + tried * penalty);
      const double left = std::max(1e-300, sums.squares - sums.gradient.dot(factor.solve(sums.gradient)));
      const double determinant = factor.vectorD().cwiseMax(1e-300).array().log().sum();
      const double likelihood = freedom * std::log(left) + determinant - rank * std::log(tried);
      if (i > 0 && likelihood >= best) continue;
      best = likelihood;
      stiffness = tried;
      variance = left / freedom;
    }
    solved.compute(normal + stiffness * penalty);
    const Eigen::VectorXd found = -solved.solve(sums.gradient);
    const double moved = (found - out.departure.head(n)).cwiseAbs().maxCoeff();
    out.departure.head(n) = found;
    if (pass > 1 && moved < 1e-6) break;
  }
  const LogCurve curve = [&](double v) { return base(v) + departure_at(out, v); };
  out.fit = fit_light(samples, pixels, curve, 0, min_scale);
  out.freedom = solved.solve(normal).trace();

  // Sandwich covariance (White 1980), clustered by pixel: residuals are independent between pixels, not within one. The
  // penalty contributes like a prior (Wahba 1983), which covers the bias of smoothing.
  const CentredSums sums = centred_sums(samples, basis, out.fit.residual, out.fit.weight);
  const double share = curvature_share(samples, out.fit);
  const Eigen::MatrixXd inverse = (share * sums.normal + stiffness * penalty).inverse();
  const double small_sample = freedom / std::max(1.0, freedom - out.freedom);
  out.covariance = Eigen::MatrixXd::Zero(knots, knots);
  const Eigen::MatrixXd shared = exposure_deviation * exposure_deviation * sums.exposure * sums.exposure.transpose();
  out.covariance.topLeftCorner(n, n) =
      inverse * (small_sample * sums.meat + shared + variance * stiffness * penalty) * inverse;
  // Discretisation error: the departure is interpolated linearly, but towards dark it is like ln v, whose chord has an
  // error of 1/(8 k²) at knot k, times the difference of the two gammas.
  for (Eigen::Index k = 1; k < n; ++k) {
    const double chord = kGammaDifference / (8.0 * static_cast<double>(k * k));
    out.covariance(k, k) += chord * chord;
  }
  return out;
}

}  // namespace lightwell::photometry
