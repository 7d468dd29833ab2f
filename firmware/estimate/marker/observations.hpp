// What was seen, in numbers of variance one: what a fit compares with its model.
//   Observations   the faces' irradiance and the table's radiance, whitened
//
// Samples of one surface share an error (its attitude, its paper, light from its neighbours): their covariance is
// D + s² 1 1', D diagonal. With z = D^-1/2 x and t = s D^-1/2 1, its inverse root makes z - t (t'z) (1 - 1 / sqrt(1 +
// t't)) / t't.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/fit_options.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// The table's samples, one number each.
struct GroundObservations {
  Vec3d point, normal;
  double step_m = 0;
  Eigen::ArrayXd x, y, z;  ///< Where they are.
  Eigen::ArrayXd u, v;     ///< In tangent_basis(normal), from `point`.
  Eigen::ArrayXd open;     ///< Share of the light from all around that reaches them.
  Eigen::ArrayXd radiance;
  Eigen::ArrayXd weight;  ///< One over the standard deviation.

  GroundObservations(const GroundPlane& table, const ErrorModel& errors);
  [[nodiscard]] Eigen::Index size() const { return x.size(); }
  /// Of the body's centre above it.
  [[nodiscard]] double height() const { return -dot(point, normal); }
};

class Observations {
 public:
  Observations(const Shading& shading, const ErrorModel& errors);

  [[nodiscard]] int samples() const { return static_cast<int>(samples_.size()); }
  [[nodiscard]] int channels() const { return channels_; }
  [[nodiscard]] const std::vector<SurfaceSample>& of_faces() const { return samples_; }
  /// What the strongest light gives to whom it meets straight, about: the largest mean of a surface, or where the table
  /// is that much brighter outside of its shadow, as much more than the darkest. And the mean over all samples. Of a
  /// channel.
  [[nodiscard]] double brightest(int channel) const { return brightest_[static_cast<std::size_t>(channel)]; }
  [[nodiscard]] double mean(int channel) const { return mean_[static_cast<std::size_t>(channel)]; }

  /// One number a sample, to one a whitened row; may be the same memory.
  void whiten(int channel, Eigen::Ref<Eigen::VectorXd> column) const;
  /// The whitened irradiances.
  [[nodiscard]] const Eigen::VectorXd& seen(int channel) const { return whitened_[static_cast<std::size_t>(channel)]; }
  /// Of a sample's difference from a model: how many of its standard deviations, its surface's included.
  [[nodiscard]] double deviations(int channel, int sample, double difference) const;

  /// The table. Null where there is none.
  [[nodiscard]] const GroundObservations* table() const { return table_ ? &*table_ : nullptr; }

 private:
  struct Surface {
    int begin = 0, end = 0;
  };

  int channels_;
  std::vector<SurfaceSample> samples_;  // by surface
  std::vector<Surface> surfaces_;
  std::array<Eigen::VectorXd, 3> whitened_, root_weight_, shared_whitened_;
  std::array<std::vector<double>, 3> shrinkage_, shared_;
  Rgb brightest_{}, mean_{};
  std::optional<GroundObservations> table_;
};

}  // namespace lightwell::marker
