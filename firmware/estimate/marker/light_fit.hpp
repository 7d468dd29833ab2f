// Nonlinear least-squares fit of point lights and ambient light from a start, with covariance (Ceres).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "estimate/marker/light_model.hpp"
#include "estimate/marker/observations.hpp"

namespace lightwell::marker {

enum class Distance : std::uint8_t { infinite, free };

/// A fitted model with its covariance and goodness of fit.
struct Fit {
  LightModel model;
  std::vector<Distance> distances;  ///< Of each light: whether its distance is a parameter.
  /// Of each light: direction in tangent_basis(direction) (rad, 2 rows) and inverse distance (1/m).
  std::vector<Eigen::Matrix3d> covariance;
  double chi_square = 0;
  int parameters = 0;
  int observations = 0;
  bool ground = false;  ///< Whether the ground plane's samples were fitted, too.
  /// Radiance of the ground plane, if fitted: under the ambient light alone, and under each light alone, unshadowed and
  /// at normal incidence.
  double ground_ambient = 0;
  std::vector<double> ground_irradiance;

  /// Bayesian information criterion (Schwarz 1978), up to a constant.
  [[nodiscard]] double bic() const;
};

/// Observations that a fit uses.
enum class ObservationSet : std::uint8_t { faces, faces_and_ground_plane };

inline constexpr int kMaxFitIterations = 40;

/// Fits to the local minimum nearest to the start. `lights`: directions and inverse distances of the start; their
/// irradiances are ignored. `hull`: points whose convex hull is the body, m, from its centre.
[[nodiscard]] Fit fit_lights(const Observations& observations, std::vector<PointLight> lights,
                             std::vector<Distance> distances, ObservationSet observation_set,
                             const std::vector<Vec3d>& hull, int max_iterations = kMaxFitIterations);

/// Residual of each face sample in standard deviations, of the channel in which it is largest.
[[nodiscard]] std::vector<double> standardized_residuals(const Observations& observations, const LightModel& model);
/// Residual of each ground sample in standard deviations.
[[nodiscard]] std::vector<double> ground_residuals(const Observations& observations, const Fit& fit,
                                                   const std::vector<Vec3d>& hull);

}  // namespace lightwell::marker
