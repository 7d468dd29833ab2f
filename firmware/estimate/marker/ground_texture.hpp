// Statistics of the ground plane's texture (wood, cloth, print): a Gaussian process, by which residuals of the ground
// samples are whitened. A texture hides a shadow only as far as it varies over the same distances.
#pragma once

#include <array>
#include <cstddef>
#include <tuple>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Positions of the ground samples, and for each its nearest earlier ones.
class GroundNeighbours {
 public:
  /// Indices below the sample's own, nearest first.
  struct Nearest {
    std::size_t count = 0;  ///< Less than kMax for the first samples.
    std::array<Eigen::Index, 6> indices{};
  };

  /// `u`, `v`: positions in the plane, m, row by row: neighbours are searched among the last kCandidates samples.
  GroundNeighbours(const Eigen::ArrayXd& u, const Eigen::ArrayXd& v);

  [[nodiscard]] Eigen::Index size() const { return u_.size(); }
  [[nodiscard]] double distance(Eigen::Index a, Eigen::Index b) const;
  [[nodiscard]] const Nearest& of(Eigen::Index sample) const { return nearest_[static_cast<std::size_t>(sample)]; }

  static constexpr std::size_t kMax = std::tuple_size_v<decltype(Nearest::indices)>;
  /// Three rows of MarkerSampler's ground samples.
  static constexpr Eigen::Index kCandidates = 80;

 private:
  Eigen::ArrayXd u_, v_;
  std::vector<Nearest> nearest_;
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
  std::vector<std::array<double, GroundNeighbours::kMax>> coefficients_;  // zero beyond count; empty: uncorrelated
  Eigen::ArrayXd inverse_sigma_;                                          // of the conditional distribution
  Eigen::ArrayXd sigma_;
  double log_determinant_ = 0;
};

/// The texture of maximum likelihood for these residuals (relative to the mean radiance), from a grid of deviations and
/// correlation lengths. Residuals beyond three robust standard deviations (objects, their shadows) count as three.
/// `step_m`: distance of neighbouring samples.
[[nodiscard]] GroundTexture fit_ground_texture(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance,
                                               double step_m, Eigen::VectorXd residuals);

}  // namespace lightwell::marker
