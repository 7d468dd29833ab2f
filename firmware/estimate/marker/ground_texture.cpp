#include "estimate/marker/ground_texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include <lightwell/quantile.hpp>

namespace lightwell::marker {
namespace {

constexpr std::size_t kMaxNeighbours = GroundNeighbours::kMaxNeighbours;
/// Limits of fit_ground_texture(): smallest and largest sigma; correlation lengths in steps; shares.
constexpr double kMinSigma = 0.001, kMaxSigma = 0.6;
/// Iterations of sigma at a given correlation: each scales it by the reduced chi square.
constexpr int kSigmaIterations = 2;
constexpr std::array kLengths = {1.5, 5.0};
constexpr std::array kCorrelated = {0.6, 0.9};
/// Robust standard deviations up to which a residual is taken as it is.
constexpr double kWinsorized = 3;

}  // namespace

GroundNeighbours::GroundNeighbours(const Eigen::ArrayXd& u, const Eigen::ArrayXd& v) : u_(u), v_(v) {
  begin_.push_back(0);
  std::vector<std::pair<double, Eigen::Index>> near;
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    near.clear();
    for (Eigen::Index k = std::max<Eigen::Index>(0, i - kCandidates); k < i; ++k) near.emplace_back(distance(i, k), k);
    const std::size_t most = std::min(kMaxNeighbours, near.size());
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(most), near.end());
    for (std::size_t k = 0; k < most; ++k) indices_.push_back(near[k].second);
    begin_.push_back(indices_.size());
  }
}

double GroundNeighbours::distance(Eigen::Index a, Eigen::Index b) const {
  return std::hypot(u_[a] - u_[b], v_[a] - v_[b]);
}

std::span<const Eigen::Index> GroundNeighbours::of(Eigen::Index sample) const {
  const auto i = static_cast<std::size_t>(sample);
  return std::span(indices_).subspan(begin_[i], begin_[i + 1] - begin_[i]);
}

GroundWhitening::GroundWhitening(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance,
                                 const GroundTexture& texture)
    : neighbours_(&neighbours), inverse_sigma_(neighbours.size()) {
  const double variance = texture.sigma * texture.sigma, shared = variance * texture.correlated;
  sigma_ = (variance + own_variance).sqrt();
  const auto covariance = [&](Eigen::Index a, Eigen::Index b) {
    return shared * std::exp(-neighbours.distance(a, b) / texture.length_m);
  };
  // Fixed sizes: no allocation per sample.
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxNeighbours, kMaxNeighbours>;
  using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxNeighbours, 1>;
  for (Eigen::Index i = 0; i < neighbours.size(); ++i) {
    const std::span<const Eigen::Index> near = neighbours.of(i);
    const auto count = static_cast<Eigen::Index>(near.size());
    double conditional = variance + own_variance[i];
    SmallVector weights = SmallVector::Zero(count);
    if (shared > 0 && count > 0) {
      Small among(count, count);
      SmallVector to_sample(count);
      for (Eigen::Index a = 0; a < count; ++a) {
        const Eigen::Index first = near[static_cast<std::size_t>(a)];
        to_sample[a] = covariance(i, first);
        for (Eigen::Index b = 0; b < a; ++b)
          among(a, b) = among(b, a) = covariance(first, near[static_cast<std::size_t>(b)]);
        among(a, a) = variance + own_variance[first];
      }
      weights = among.llt().solve(to_sample);
      conditional -= weights.dot(to_sample);
    }
    // Rounding may leave less than the uncorrelated part.
    conditional = std::max(conditional, variance - shared + own_variance[i]) + 1e-12;
    for (Eigen::Index a = 0; a < count; ++a) coefficients_.push_back(weights[a]);
    inverse_sigma_[i] = 1 / std::sqrt(conditional);
    log_determinant_ += std::log(conditional);
  }
}

void GroundWhitening::whiten(Eigen::Ref<Eigen::VectorXd> column) const {
  // From the last sample to the first, because a sample depends on earlier ones alone.
  std::size_t at = coefficients_.size();
  for (Eigen::Index i = column.size() - 1; i >= 0; --i) {
    const std::span<const Eigen::Index> near = neighbours_->of(i);
    at -= near.size();
    double value = column[i];
    for (std::size_t k = 0; k < near.size(); ++k) value -= coefficients_[at + k] * column[near[k]];
    column[i] = value * inverse_sigma_[i];
  }
}

GroundTexture fit_ground_texture(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance, double step_m,
                                 Eigen::VectorXd residuals) {
  GroundTexture best;
  if (residuals.size() == 0) return best;
  std::vector<double> sizes;
  for (const double r : residuals) sizes.push_back(std::abs(r));
  const double limit = kWinsorized * 1.4826 * order_statistic(sizes, sizes.size() / 2) + kMinSigma;
  residuals = residuals.cwiseMin(limit).cwiseMax(-limit);
  const double spread =
      std::clamp(std::sqrt(residuals.squaredNorm() / static_cast<double>(residuals.size())), kMinSigma, kMaxSigma);
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](double correlated, double length_m) {
    GroundTexture texture{spread, correlated, length_m};
    for (int round = 0;; ++round) {
      const GroundWhitening whitening(neighbours, own_variance, texture);
      Eigen::VectorXd column = residuals;
      whitening.whiten(column);
      const double chi_square = column.squaredNorm();
      // Minus twice the logarithm of the likelihood, up to a constant.
      const double deviance = chi_square + whitening.log_determinant();
      if (deviance < least) least = deviance, best = texture;
      if (round == kSigmaIterations) return;
      const double reduced = chi_square / static_cast<double>(residuals.size());
      texture.sigma = std::clamp(texture.sigma * std::sqrt(reduced), kMinSigma, kMaxSigma);
    }
  };
  consider(0, step_m);
  for (const double length : kLengths)
    for (const double correlated : kCorrelated) consider(correlated, length * step_m);
  return best;
}

}  // namespace lightwell::marker
