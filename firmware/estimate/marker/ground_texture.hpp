// Statistics of the ground plane's texture (wood, cloth, print): a Gaussian process, by which residuals of the ground
// samples are whitened. A texture hides a shadow only as far as it varies over the same distances.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Positions of the ground samples, and for each its nearest earlier ones.
class GroundNeighbours {
 public:
  /// `u`, `v`: positions in the plane, m, row by row: neighbours are searched among the last kCandidates samples.
  GroundNeighbours(const Eigen::ArrayXd& u, const Eigen::ArrayXd& v);

  [[nodiscard]] Eigen::Index size() const { return u_.size(); }
  [[nodiscard]] double distance(Eigen::Index a, Eigen::Index b) const;
  /// Indices below `sample`, nearest first, at most kMaxNeighbours.
  [[nodiscard]] std::span<const Eigen::Index> of(Eigen::Index sample) const;

  static constexpr std::size_t kMaxNeighbours = 6;
  /// Three rows of MarkerSampler's ground samples.
  static constexpr Eigen::Index kCandidates = 80;

 private:
  Eigen::ArrayXd u_, v_;
  std::vector<Eigen::Index> indices_;
  std::vector<std::size_t> begin_;
};

/// Approximate inverse square root of a covariance: sample i is conditioned on its nearest earlier samples alone
/// (Vecchia 1988, "Estimation and model identification for continuous spatial processes", eq. 4). Without a correlated
/// part it is exact.
class GroundWhitening {
 public:
  GroundWhitening() = default;
  /// `own_variance`: of each sample, in addition to the texture. All in units of the squared mean radiance.
  GroundWhitening(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance, const GroundTexture& texture);

  /// In place; one row per sample.
  void whiten(Eigen::Ref<Eigen::VectorXd> column) const;
  /// Logarithm of the covariance's determinant.
  [[nodiscard]] double log_determinant() const { return log_determinant_; }
  /// Standard deviation of each sample's residual by itself.
  [[nodiscard]] const Eigen::ArrayXd& sigma() const { return sigma_; }

 private:
  const GroundNeighbours* neighbours_ = nullptr;
  std::vector<double> coefficients_;  // in the order of the neighbours' indices
  Eigen::ArrayXd inverse_sigma_;      // of the conditional distribution
  Eigen::ArrayXd sigma_;
  double log_determinant_ = 0;
};

/// The texture of maximum likelihood for these residuals (relative to the mean radiance), from a grid of deviations and
/// correlation lengths. Residuals beyond three robust standard deviations (objects, their shadows) count as three.
/// `step_m`: distance of neighbouring samples.
[[nodiscard]] GroundTexture fit_ground_texture(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance,
                                               double step_m, Eigen::VectorXd residuals);

}  // namespace lightwell::marker
