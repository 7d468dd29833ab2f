// Places of matched lights, by bundle adjustment.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/field.hpp>

#include "field/intensity.hpp"
#include "field/triangulate.hpp"
#include "field/views.hpp"

namespace lightwell::field {

/// A matched light with its place.
struct Placed {
  std::vector<std::size_t> members;  ///< Observations.
  bool distant = false;
  Vec3d position;           ///< Unless distant.
  Symmetric3 covariance{};  ///< Of the position, m².
  Vec3d direction;          ///< Of a distant light, unit.
  double direction_sigma_rad = 0;
  /// Of a distant light: its direction turns by this much per metre, rad/m, one standard deviation.
  double parallax_sigma = 0;
  double radius = 0;  ///< m; distant: rad.
  IntensityModel intensity;
};

/// Estimates all lights and corrections of all poses together, with Ceres: each light as a direction from an anchor and
/// an inverse distance (Civera, Davison & Montiel 2008), the poses with their covariances as priors. A light whose
/// inverse distance is within two standard deviations of zero is distant. Observations that do not fit leave their
/// light; a light left with one observation that has no measured distance is dropped. Intensities are not set.
[[nodiscard]] std::vector<Placed> place_lights(std::span<const ProbeView> views,
                                               std::span<const Observation> observations,
                                               std::span<const std::vector<std::size_t>> groups);

}  // namespace lightwell::field
