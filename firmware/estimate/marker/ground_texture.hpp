// Statistics of the ground plane's texture (wood, cloth, print) and of a smooth variation of its brightness: Gaussian
// processes, by which residuals of the ground samples are whitened. They hide a shadow only as far as they vary over
// the same distances.
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
  /// One column for each of u, v, u², u v, v², measured from the mean position of the samples, relative to the largest
  /// distance from there.
  [[nodiscard]] Eigen::MatrixXd smooth_terms() const;

  static constexpr std::size_t kMax = std::tuple_size_v<decltype(Nearest::indices)>;
  /// Three rows of MarkerSampler's ground samples at the usual step.
  static constexpr Eigen::Index kCandidates = 80;

 private:
  Eigen::ArrayXd u_, v_;
  std::vector<Nearest> nearest_;
};

/// Approximate inverse square root of the covariance of the samples' residuals: own variance, texture, and a smooth
/// variation of the brightness (sheen, light of a room) with independent coefficients of smooth_terms().
/// Of the texture, sample i is conditioned on its nearest earlier samples alone (Vecchia 1988, "Estimation and model
/// identification for continuous spatial processes", eq. 4). Without a correlated part it is exact.
class GroundWhitening {
 public:
  GroundWhitening() = default;
  /// `own_variance`: of each sample, in addition to the texture and the smooth variation. All in units of the squared
  /// mean radiance.
  GroundWhitening(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance, const GroundTexture& texture);

  /// In place; one row per sample.
  void whiten(Eigen::Ref<Eigen::VectorXd> column) const;
  /// Logarithm of the covariance's determinant.
  [[nodiscard]] double log_determinant() const { return log_determinant_; }
  /// Expectation of the smooth variation, given the residuals.
  [[nodiscard]] Eigen::VectorXd smooth_part(const Eigen::VectorXd& residuals) const;

 private:
  /// Whitens the own variance and the texture.
  void whiten_texture(Eigen::Ref<Eigen::VectorXd> column) const;

  const GroundNeighbours* neighbours_ = nullptr;
  std::vector<std::array<double, GroundNeighbours::kMax>> coefficients_;  // zero beyond count; empty: uncorrelated
  Eigen::ArrayXd inverse_sigma_;                                          // of the conditional distribution
  Eigen::MatrixXd smooth_;                                                // terms times their standard deviations
  Eigen::MatrixXd whitened_smooth_;                                       // whiten_texture() of them
  Eigen::MatrixXd directions_;                                            // orthonormal columns of the same span
  Eigen::VectorXd shrinkage_;                                             // of each: 1 - 1 / sqrt(1 + its variance)
  double log_determinant_ = 0;
};

/// Likelihood of residuals under the likeliest of a grid of textures, which is computed once for all residuals.
class GroundLikelihood {
 public:
  /// `own_variance`: as of GroundWhitening. `step_m`: distance of neighbouring samples.
  GroundLikelihood(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance, double step_m);

  /// Minus twice the logarithm of the likelihood of residuals (relative to the mean radiance), up to a constant.
  /// Residuals beyond three robust standard deviations count as three.
  [[nodiscard]] double deviance(Eigen::VectorXd residuals) const;

 private:
  std::vector<GroundWhitening> whitenings_;
};

/// The texture of maximum likelihood for these residuals (relative to the mean radiance), from a grid of deviations and
/// correlation lengths. Residuals beyond three robust standard deviations (objects, their shadows) count as three.
/// `step_m`: distance of neighbouring samples.
[[nodiscard]] GroundTexture fit_ground_texture(const GroundNeighbours& neighbours, const Eigen::ArrayXd& own_variance,
                                               double step_m, Eigen::VectorXd residuals);

}  // namespace lightwell::marker
