// Nonlinear least squares: point lights and ambient light that explain the observations of one frame, from a start.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/fit_parameters.hpp"
#include "estimate/marker/observations.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// A fitted model with its covariance and goodness of fit.
struct Fit {
  LightModel model;
  std::vector<Distance> distances;  ///< Of each light: whether its distance is a parameter.
  /// Of each light: direction in tangent_basis(direction) (rad, 2 rows) and inverse distance (1/m). Multiplied by
  /// dispersion().
  std::vector<Eigen::Matrix3d> covariance;
  double chi_square = 0;         ///< Of all residuals and of the priors.
  double face_chi_square = 0;    ///< Of the faces' samples alone.
  double ground_chi_square = 0;  ///< Of the ground's samples alone.
  double ground_deviance = 0;    ///< GroundObservations::marginal_deviance(); 0 after tracking.
  int parameters = 0;
  int observations = 0;
  int face_samples = 0;       ///< Samples, each of all channels: the channels have the same errors.
  double ground_samples = 0;  ///< At the usual step: GroundPlane::density samples count as one.
  int channels = 1;
  bool ground = false;  ///< Whether the ground plane's samples were fitted, too.
  /// Radiance of the ground plane, if fitted: by the ambient light alone, and by each light, unshadowed, at its normal.
  double ground_ambient = 0;
  std::vector<double> ground_irradiance;

  /// Factor of all variances, at least 1: the reduced chi square relative to that of pictures that the model explains
  /// (the overdispersion of Burnham & Anderson 2002, "Model Selection and Multimodel Inference", section 2.5).
  [[nodiscard]] double dispersion() const;
  /// The same for the faces' samples alone; may be below 1.
  [[nodiscard]] double face_dispersion() const;
  /// Minus twice the logarithm of the likelihood, up to a constant. The errors of the faces have an unknown common
  /// factor: a multivariate t distribution (Lange, Little & Taylor 1989, "Robust statistical modeling using the t
  /// distribution", eq. 1). Those of the ground have the likeliest texture: ground_deviance.
  [[nodiscard]] double deviance() const;
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
/// Residual radiance of each ground sample; none where no ground plane was sampled.
[[nodiscard]] Eigen::ArrayXd ground_residuals(const Observations& observations, const Fit& fit,
                                              const std::vector<Vec3d>& hull);

}  // namespace lightwell::marker
