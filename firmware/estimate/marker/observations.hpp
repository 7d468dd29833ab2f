// Measurements of one frame, whitened: linear combinations with independent errors of variance 1.
//   Observations         irradiance of the faces
//   GroundObservations   radiance of the ground plane
//
// The samples of one surface share an error (attitude, paper, interreflection): their covariance is D + s² 1 1', D
// diagonal. With z = D^-1/2 x and t = s D^-1/2 1, the inverse square root of the covariance maps x to
// z - t (t'z) (1 - 1 / sqrt(1 + t't)) / t't.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/fit_options.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Samples of the ground plane (the table), one channel: the mean of r, g and b. One array element per sample.
struct GroundObservations {
  Vec3d point, normal;
  double step_m = 0;
  Eigen::ArrayXd x, y, z;  ///< Position, m, from the body's centre.
  Eigen::ArrayXd u, v;     ///< Position in tangent_basis(normal), m, from `point`.
  Eigen::ArrayXd open;     ///< Share of the ambient irradiance that the body does not occlude, 0 to 1.
  Eigen::ArrayXd radiance;
  Eigen::ArrayXd weight;  ///< 1 / standard deviation of the radiance.

  GroundObservations(const GroundPlane& ground, const ErrorModel& errors);
  [[nodiscard]] Eigen::Index size() const { return x.size(); }
  /// Height of the body's centre above the plane, m.
  [[nodiscard]] double height() const { return -dot(point, normal); }
};

class Observations {
 public:
  Observations(const Shading& shading, const ErrorModel& errors);

  [[nodiscard]] int samples() const { return static_cast<int>(samples_.size()); }
  [[nodiscard]] int channels() const { return channels_; }
  [[nodiscard]] const std::vector<SurfaceSample>& face_samples() const { return samples_; }
  /// Rough irradiance of the strongest light at normal incidence: the largest mean over a surface, or the smallest mean
  /// times the contrast of the shadow on the ground plane, whichever is more.
  [[nodiscard]] double max_irradiance(int channel) const { return max_irradiance_[static_cast<std::size_t>(channel)]; }
  /// Mean over all samples of the faces.
  [[nodiscard]] double mean_irradiance(int channel) const {
    return mean_irradiance_[static_cast<std::size_t>(channel)];
  }

  /// Whitens a column of one value per sample, in place.
  void whiten(int channel, Eigen::Ref<Eigen::VectorXd> column) const;
  /// The whitened irradiances, one row per sample.
  [[nodiscard]] const Eigen::VectorXd& whitened(int channel) const {
    return whitened_[static_cast<std::size_t>(channel)];
  }
  /// `difference` (of a sample's irradiance from a model's) divided by its standard deviation, the error shared by its
  /// surface included.
  [[nodiscard]] double standardized_residual(int channel, int sample, double difference) const;

  /// Null where no ground plane was sampled.
  [[nodiscard]] const GroundObservations* ground() const { return ground_ ? &*ground_ : nullptr; }

 private:
  struct Surface {
    int begin = 0, end = 0;
  };

  int channels_;
  std::vector<SurfaceSample> samples_;  // by surface
  std::vector<Surface> surfaces_;
  std::array<Eigen::VectorXd, 3> whitened_, root_weight_, shared_whitened_;
  std::array<std::vector<double>, 3> shrinkage_, shared_;
  Rgb max_irradiance_{}, mean_irradiance_{};
  std::optional<GroundObservations> ground_;
};

}  // namespace lightwell::marker
