// Estimates the lighting of one frame from a marker's shading: point lights, ambient light and their uncertainty.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Hypothesis about the surroundings of the body.
enum class SurroundModel : std::uint8_t {
  distant,                   ///< No ground plane: the surroundings are far away and a part of the light.
  ground_plane,              ///< A ground plane (a table); the light that it reflects onto the faces is subtracted.
  ground_plane_with_shadow,  ///< Likewise, and the body's shadow on the plane is observed, too.
};

/// A light is `uncertain` where the standard deviation of its direction along the worse axis exceeds this (6.9
/// degrees), where directions more than 25 degrees away have a probability above 5 % or raise it above 11.5 degrees, or
/// where, without a shadow, a disc that is so wide that its middle is known to 8.6 degrees only explains the faces as
/// well. After tracking: as of the last search, or the standard deviation is above 11.5 degrees.
inline constexpr double kMaxDirectionSigma_rad = 0.12;
inline constexpr int kMaxPointLights = 3;

struct LightEstimate {
  PointLight light;
  /// In tangent_basis(direction), rad². Includes other directions and models that explain the observations as well, as
  /// of the last global search.
  std::array<double, 3> direction_covariance{};  ///< u·u, u·v, v·v
  double fit_variance = 0;                       ///< Trace of the fit's own part of it, rad².
  double inverse_distance_sigma = 0;             ///< 1/m; infinite where the distance was not estimated.
  bool distance_observable = false;              ///< Inverse distance above two standard deviations.
  bool uncertain = false;                        ///< As described at kMaxDirectionSigma_rad.
  bool distance_estimated = false;               ///< Whether the distance was a parameter of the fit.

  /// From the body's centre, m; infinite for a distant light.
  [[nodiscard]] double distance_m() const { return 1 / light.inverse_distance; }
  /// Standard deviation of the distance, m, to first order.
  [[nodiscard]] double distance_sigma_m() const { return inverse_distance_sigma * distance_m() * distance_m(); }
};

struct LightingEstimate {
  std::array<Rgb, 4> ambient{};  ///< As LightModel::ambient; without `ground`.
  /// Irradiance by the light that the ground plane sends to the body's centre, as if the body were absent, in the same
  /// form. Zero for distant surroundings: then `ambient`, `lights` and `inliers` contain it.
  std::array<Rgb, 4> ground{};
  std::vector<LightEstimate> lights;  ///< Strongest first.
  double chi_square = 0;              ///< Reduced: divided by the degrees of freedom.
  double chi_square_at_search = 0;    ///< Reduced chi square of the last global search.
  SurroundModel surround_model = SurroundModel::distant;
  /// No light was found, the strongest light is uncertain, or the ambient light may hide a stronger one.
  bool uncertain = false;
  /// Either the shadow on the ground plane determines the lights, or each light's direction is within
  /// kMaxDirectionSigma_rad before source size is considered and the ambient light is nowhere negative. The model
  /// then also predicts the irradiance at normals between the faces.
  bool localized = false;
  int outliers = 0;  ///< Face samples that were rejected.
  int used = 0;
  std::optional<GroundTexture> ground_texture;  ///< Of the last search, if a ground plane was used.
  double face_dispersion = 1;                   ///< Factor of the variances of the faces' samples, of the last search.
  bool tracked = false;  ///< Whether the fit started from the previous frame's lights; false: global search.
  std::vector<SurfaceSample> inliers;  ///< Face samples without the outliers and without the ground plane's light.
};

/// Standard deviation along the worse axis, rad, of a direction's covariance (u·u, u·v, v·v).
[[nodiscard]] double worst_sigma(const std::array<double, 3>& covariance);

/// `previous`: the previous frame's estimate or null. One fit starts from its lights; it is accepted while its reduced
/// chi square is close to that of the last search. Otherwise a global search runs, which takes fifty times as long as
/// the fit. Without samples, the estimate has no lights and is uncertain.
[[nodiscard]] LightingEstimate estimate_lighting(const Shading& shading, const LightingEstimate* previous = nullptr,
                                                 int max_lights = kMaxPointLights);

}  // namespace lightwell::marker
