// Lamps in their best places: from a start to the least squares, with covariance (Ceres).
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/fit_options.hpp"
#include "estimate/marker/light_model.hpp"
#include "estimate/marker/observations.hpp"

namespace lightwell::marker {

enum class Distance : std::uint8_t { infinite, free };

/// A model that was fitted, and how well.
struct Fit {
  LightModel model;
  std::vector<Distance> distances;  ///< Of each lamp: whether its distance was looked for.
  /// Of each lamp: of its direction in tangent_basis(direction) (rad) and its inverse distance (1/m).
  std::vector<Eigen::Matrix3d> covariance;
  double chi_square = 0;
  int parameters = 0;
  int observations = 0;
  bool table = false;  ///< Whether the table told too.
  /// Of the table, where it told: radiance of light from all around, and of each lamp where nothing shades it and it
  /// falls vertically.
  double ground_ambient = 0;
  std::vector<double> ground_irradiance;

  /// Schwarz's criterion, up to a constant.
  [[nodiscard]] double bic() const;
};

enum class ObservationSet : std::uint8_t { faces, faces_and_ground_plane };

/// `lamps`: their directions and inverse distances are the start, their irradiance does not matter. Ends in the nearest
/// minimum.
[[nodiscard]] Fit fit_lights(const Observations& seen, std::vector<PointLight> lights, std::vector<Distance> distances,
                            ObservationSet observation_set, const std::vector<Vec3d>& hull, const FitOptions& options);

/// Of each sample of the faces: how many standard deviations it differs from the model, in the channel where most.
[[nodiscard]] std::vector<double> standardized_residuals(const Observations& seen, const LightModel& model);
/// Of each sample of the table, likewise.
[[nodiscard]] std::vector<double> ground_residuals(const Observations& seen, const Fit& fit,
                                                        const std::vector<Vec3d>& hull);

}  // namespace lightwell::marker
