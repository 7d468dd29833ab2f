#include "estimate/marker/ground_texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <lightwell/quantile.hpp>

namespace lightwell::marker {
namespace {

/// Limits of fit_ground_texture(): smallest and largest sigma; correlation lengths in steps; shares.
constexpr double kMinSigma = 0.001, kMaxSigma = 0.6;
/// Iterations of sigma at a given correlation: each scales it by the reduced chi square.
constexpr int kSigmaIterations = 2;
constexpr std::array kLengths = {1.5, 5.0};
constexpr std::array kCorrelated = {0.6, 0.9};
/// Standard deviations of the coefficients of smooth_terms(), relative to the mean radiance: of u and v, of the others.
constexpr double kSlopeSigma = 0.25, kCurvatureSigma = 0.15;
/// Robust standard deviations up to which a residual is taken as it is.
constexpr double kWinsorized = 3;
/// Standard deviations of the textures of GroundLikelihood.
constexpr std::array kSigmas = {0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32};

void winsorize(Eigen::VectorXd& residuals) {
  if (residuals.size() == 0) return;
  std::vector<double> sizes;
  for (const double r : residuals) sizes.push_back(std::abs(r));
  const double limit = kWinsorized * 1.4826 * order_statistic(sizes, sizes.size() / 2) + kMinSigma;
  residuals = residuals.cwiseMin(limit).cwiseMax(-limit);
}

}  // namespace

GroundNeighbours::GroundNeighbours(const Eigen::ArrayXd& u, const Eigen::ArrayXd& v)
    : u_(u), v_(v), nearest_(static_cast<std::size_t>(u.size())) {
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    Nearest& nearest = nearest_[static_cast<std::size_t>(i)];
    std::array<double, kMax> squared{};
    // From the last to the first: the last ones are the nearest, and most others are passed over.
    for (Eigen::Index k = i - 1; k >= std::max<Eigen::Index>(0, i - kCandidates); --k) {
      const double du = u[i] - u[k], dv = v[i] - v[k], d = du * du + dv * dv;
      std::size_t at = nearest.count;
      if (at == kMax && !(d < squared[kMax - 1])) continue;
      if (at < kMax)
        ++nearest.count;
      else
        --at;
      for (; at > 0 && d < squared[at - 1]; --at)
        squared[at] = squared[at - 1], nearest.indices[at] = nearest.indices[at - 1];
      squared[at] = d, nearest.indices[at] = k;
    }
  }
}

Eigen::MatrixXd GroundNeighbours::smooth_terms() const {
  Eigen::MatrixXd out(size(), 5);
  if (size() == 0) return out;
  Eigen::ArrayXd u = u_ - u_.mean(), v = v_ - v_.mean();
  const double reach = std::max(std::sqrt((u.square() + v.square()).maxCoeff()), 1e-300);
  u /= reach, v /= reach;
  out << u.matrix(), v.matrix(), u.square().matrix(), (u * v).matrix(), v.square().matrix();
  return out;
}

double GroundNeighbours::distance(Eigen::Index a, Eigen::Index b) const {
  const double du = u_[a] - u_[b], dv = v_[a] - v_[b];
  return std::sqrt(du * du + dv * dv);
}

GroundWhitening::GroundWhitening(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance,
                                 const GroundTexture& texture)
    : neighbours_(&neighbours), inverse_sigma_(neighbours.size()) {
  const double variance = texture.sigma * texture.sigma, shared = variance * texture.correlated;
  const auto covariance = [&](Eigen::Index a, Eigen::Index b) {
    return shared * std::exp(-neighbours.distance(a, b) / texture.length_m);
  };
  // Fixed sizes: no allocation per sample.
  constexpr int kMax = GroundNeighbours::kMax;
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMax, kMax>;
  using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMax, 1>;
  if (shared > 0) coefficients_.resize(static_cast<std::size_t>(neighbours.size()));
  for (Eigen::Index i = 0; i < neighbours.size(); ++i) {
    double conditional = variance + own_variance[i];
    const GroundNeighbours::Nearest& near = neighbours.of(i);
    if (shared > 0 && near.count > 0) {
      const auto count = static_cast<Eigen::Index>(near.count);
      Small among(count, count);
      SmallVector to_sample(count);
      for (Eigen::Index a = 0; a < count; ++a) {
        const Eigen::Index first = near.indices[static_cast<std::size_t>(a)];
        to_sample[a] = covariance(i, first);
        for (Eigen::Index b = 0; b < a; ++b)
          among(a, b) = among(b, a) = covariance(first, near.indices[static_cast<std::size_t>(b)]);
        among(a, a) = variance + own_variance[first];
      }
      const SmallVector weights = among.llt().solve(to_sample);
      conditional -= weights.dot(to_sample);
      std::ranges::copy(weights, coefficients_[static_cast<std::size_t>(i)].begin());
    }
    // Rounding may leave less than the uncorrelated part.
    conditional = std::max(conditional, variance - shared + own_variance[i]) + 1e-12;
    inverse_sigma_[i] = 1 / std::sqrt(conditional);
    log_determinant_ += std::log(conditional);
  }
  smooth_ = neighbours.smooth_terms();
  smooth_.leftCols<2>() *= kSlopeSigma;
  smooth_.rightCols<3>() *= kCurvatureSigma;
  whitened_smooth_ = smooth_;
  for (Eigen::Index k = 0; k < smooth_.cols(); ++k) whiten_texture(whitened_smooth_.col(k));
  const Eigen::MatrixXd gram = whitened_smooth_.transpose() * whitened_smooth_;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gram);
  const Eigen::ArrayXd variances = eigen.eigenvalues().array().max(0.0);
  // A term that does not vary over the samples has no direction.
  const Eigen::ArrayXd lengths = variances.sqrt().max(1e-9);
  directions_ = whitened_smooth_ * eigen.eigenvectors() * lengths.inverse().matrix().asDiagonal();
  shrinkage_ = 1 - (1 + variances).rsqrt();
  log_determinant_ += (1 + variances).log().sum();
}

void GroundWhitening::whiten(Eigen::Ref<Eigen::VectorXd> column) const {
  whiten_texture(column);
  column -= directions_ * shrinkage_.cwiseProduct(directions_.transpose() * column);
}

Eigen::VectorXd GroundWhitening::smooth_part(const Eigen::VectorXd& residuals) const {
  Eigen::VectorXd whitened = residuals;
  whiten_texture(whitened);
  const Eigen::Index terms = smooth_.cols();
  const Eigen::MatrixXd precision =
      Eigen::MatrixXd::Identity(terms, terms) + whitened_smooth_.transpose() * whitened_smooth_;
  return smooth_ * precision.llt().solve(whitened_smooth_.transpose() * whitened);
}

void GroundWhitening::whiten_texture(Eigen::Ref<Eigen::VectorXd> column) const {
  // From the last sample to the first, because a sample depends on earlier ones alone.
  if (!coefficients_.empty())
    for (Eigen::Index i = column.size() - 1; i >= 0; --i) {
      const auto& coefficients = coefficients_[static_cast<std::size_t>(i)];
      const auto& indices = neighbours_->of(i).indices;
      double predicted = 0;
      for (std::size_t k = 0; k < indices.size(); ++k) predicted += coefficients[k] * column[indices[k]];
      column[i] -= predicted;
    }
  column.array() *= inverse_sigma_;
}

GroundLikelihood::GroundLikelihood(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance,
                                   double step_m) {
  for (const double sigma : kSigmas) {
    whitenings_.emplace_back(neighbours, own_variance, GroundTexture{sigma, 0, step_m});
    for (const double length : kLengths)
      for (const double correlated : kCorrelated)
        whitenings_.emplace_back(neighbours, own_variance, GroundTexture{sigma, correlated, length * step_m});
  }
}

double GroundLikelihood::deviance(Eigen::VectorXd residuals) const {
  winsorize(residuals);
  double least = std::numeric_limits<double>::infinity();
  for (const GroundWhitening& whitening : whitenings_) {
    Eigen::VectorXd column = residuals;
    whitening.whiten(column);
    least = std::min(least, column.squaredNorm() + whitening.log_determinant());
  }
  return least;
}

GroundTexture fit_ground_texture(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance, double step_m,
                                 Eigen::VectorXd residuals) {
  GroundTexture best;
  if (residuals.size() == 0) return best;
  winsorize(residuals);
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
