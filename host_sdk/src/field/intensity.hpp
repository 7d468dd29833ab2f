// How the radiant intensity of a light depends on direction.
#pragma once

#include <array>
#include <optional>
#include <span>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::field {

/// Intensity seen from one place.
struct IntensityObservation {
  Vec3d from_light;      ///< Unit, from the light to the place.
  Irradiance intensity;  ///< Irradiance times squared distance; of a distant light the irradiance.
  double relative_sigma = 0;
};

/// I(w) = max(0, mean + gradient . w): a ball has gradient 0, a flat Lambertian emitter with the normal n mean 0 and
/// gradient I0 n.
struct IntensityModel {
  Irradiance mean;
  std::array<Irradiance, 3> gradient{};
  /// Covariance of (mean, gradient) relative to `scale` (luminance), row by row.
  std::array<double, 16> covariance{};
  double scale = 0;

  [[nodiscard]] Irradiance towards(Vec3d from_light) const;
  /// Standard deviation of the luminance of towards().
  [[nodiscard]] double sigma(Vec3d from_light) const;
};

/// Bayesian linear regression with several Gaussian priors, from a ball to a flat emitter. The model is that of the
/// largest evidence, so that few observations that agree give a ball; its covariance is averaged over all priors by
/// their evidence, with the observations' variance raised to their misfit. At least one observation. `surface_normal`:
/// of the geometry in whose surface the light is, towards where it is seen from.
[[nodiscard]] IntensityModel fit_intensity(std::span<const IntensityObservation> observations,
                                           std::optional<Vec3d> surface_normal);

/// The same for a light whose intensity does not depend on direction, or is not known to.
[[nodiscard]] IntensityModel uniform_intensity(std::span<const IntensityObservation> observations);

}  // namespace lightwell::field
