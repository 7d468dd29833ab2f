// Measurements of one frame, whitened: linear combinations with independent errors of variance 1.
//
// The samples of one surface share an error (attitude, paper, interreflection): their covariance is D + s² 1 1', D
// diagonal. With z = D^-1/2 x and t = s D^-1/2 1, the inverse square root of the covariance maps x to
// z - t (t'z) (1 - 1 / sqrt(1 + t't)) / t't. All samples share the lens's vignetting, if it is not calibrated: the same
// formula is applied to the result, with t = the whitened effect of one standard deviation of it.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/convex_hull_2d.hpp"
#include "estimate/marker/ground_texture.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Places of the samples of the ground plane (the table). One array element per sample.
struct GroundGeometry {
  Vec3d point, normal;
  double step_m = 0, density = 1;  ///< As of GroundPlane.
  Eigen::ArrayXd x, y, z;          ///< Position, m, from the body's centre.
  Eigen::ArrayXd u, v;             ///< Position in tangent_basis(normal), m, from `point`.
  Eigen::ArrayXd open;             ///< Share of the ambient irradiance that the body does not occlude, 0 to 1.

  explicit GroundGeometry(const GroundPlane& ground);
  [[nodiscard]] Eigen::Index size() const { return x.size(); }
  /// Height of the body's centre above the plane, m.
  [[nodiscard]] double height() const { return -dot(point, normal); }
};

/// Samples of the ground plane, one channel: the mean of r, g and b.
struct GroundObservations : GroundGeometry {
  Eigen::ArrayXd radiance;
  double mean_radiance = 0;
  GroundNeighbours neighbours;
  Eigen::ArrayXd own_variance;  ///< Of each sample by itself; relative to the squared mean radiance.
  GroundTexture texture{.sigma = 0};
  GroundWhitening whitening;
  Eigen::ArrayXd noise_variance;  ///< As own_variance, without the errors of the shadow's model.
  mutable std::optional<GroundLikelihood> likelihood;

  /// `known_texture`: of an earlier fit. nullopt: none.
  GroundObservations(const GroundPlane& ground, const std::optional<GroundTexture>& known_texture);
  GroundObservations(const GroundObservations&) = delete;
  GroundObservations& operator=(const GroundObservations&) = delete;
  /// Whitens a column of one radiance per sample, in place.
  void whiten(Eigen::Ref<Eigen::VectorXd> column) const;
  [[nodiscard]] Eigen::VectorXd whitened(const Eigen::ArrayXd& radiances) const;
  /// The texture of maximum likelihood for residual radiances.
  [[nodiscard]] GroundTexture fit_texture(const Eigen::ArrayXd& residuals) const;
  /// Expected smooth variation of the radiance, given residual radiances.
  [[nodiscard]] Eigen::ArrayXd smooth_part(const Eigen::ArrayXd& residuals, const GroundTexture& of_texture) const;
  /// GroundLikelihood::deviance() of residual radiances, computed at first use. Not thread-safe.
  [[nodiscard]] double marginal_deviance(const Eigen::ArrayXd& residuals) const;
  /// Minus twice the logarithm of the likelihood of residual radiances, up to a constant.
  [[nodiscard]] double deviance(const Eigen::ArrayXd& residuals, const GroundTexture& of_texture) const;
};

/// Irradiance of the ground plane by one point light, with the body's shadow. Reuses its memory from call to call.
class Shadow {
 public:
  /// Irradiance of each ground sample by a light at direction / inverse_distance (1/m; 0: distant) whose irradiance at
  /// the body's centre is 1: cosine, falloff, and visibility past the body. The edge of the shadow is a smooth step as
  /// wide as 1.2 samples plus 0.05 times the height of the body's centre. Returns false and zeros where the light is
  /// below the plane or the outline of the shadow is degenerate.
  bool compute_irradiance(const GroundGeometry& ground, std::span<const Vec3d> hull, Vec3d direction,
                          double inverse_distance, Eigen::ArrayXd& out);

 private:
  ConvexHull2d outline_;
  Eigen::ArrayXd visibility_, squared_;
};

class Observations {
 public:
  /// `known_texture`: as of GroundObservations. `face_dispersion`: factor of all variances of the faces' samples.
  explicit Observations(const Shading& shading, const std::optional<GroundTexture>& known_texture = std::nullopt,
                        double face_dispersion = 1);

  [[nodiscard]] int samples() const { return static_cast<int>(samples_.size()); }
  [[nodiscard]] int channels() const { return channels_; }
  [[nodiscard]] const std::vector<SurfaceSample>& face_samples() const { return samples_; }
  /// Rough irradiance of the strongest light at normal incidence: the largest mean over a surface, or the smallest mean
  /// times the contrast of the shadow on the ground plane, whichever is more.
  [[nodiscard]] double max_irradiance(int channel) const { return of(channel).max_irradiance; }
  /// Mean over all samples of the faces.
  [[nodiscard]] double mean_irradiance(int channel) const { return of(channel).mean_irradiance; }

  /// Whitens a column of one value per sample, in place.
  void whiten(int channel, Eigen::Ref<Eigen::VectorXd> column) const;
  /// The whitened irradiances, one row per sample.
  [[nodiscard]] const Eigen::VectorXd& whitened(int channel) const { return of(channel).whitened; }
  /// `difference` (of a sample's irradiance from a model's) by its standard deviation, the surface's error included.
  [[nodiscard]] double standardized_residual(int channel, int sample, double difference) const;

  /// Null where no ground plane was sampled.
  [[nodiscard]] const GroundObservations* ground() const { return ground_ ? &*ground_ : nullptr; }

 private:
  struct Surface {
    int begin = 0, end = 0;
  };

  /// By sample: `whitened`, `root_weight`, `shared_whitened`, `vignetting` (its effect), `vignetting_whitened`. By
  /// surface: `shrinkage`, `shared`.
  struct Channel {
    Eigen::VectorXd whitened, root_weight, shared_whitened, vignetting, vignetting_whitened;
    std::vector<double> shrinkage, shared;
    double vignetting_shrinkage = 0;
    double max_irradiance = 0, mean_irradiance = 0;
  };
  void whiten_surfaces(const Channel& channel, Eigen::Ref<Eigen::VectorXd> column) const;
  [[nodiscard]] const Channel& of(int channel) const { return by_channel_[static_cast<std::size_t>(channel)]; }

  int channels_;
  std::vector<SurfaceSample> samples_;  // by surface
  std::vector<Surface> surfaces_;
  std::array<Channel, 3> by_channel_;
  std::optional<GroundObservations> ground_;
};

}  // namespace lightwell::marker
