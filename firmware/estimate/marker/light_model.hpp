// Parametric light model: ambient light of SH bands 0 and 1, and distant or near point lights.
//   PointLight, LightModel
//   relative_irradiance   irradiance of a small surface relative to that at the body's centre
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <lightwell/geometry.hpp>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Position relative to the body's centre: direction / inverse_distance. The inverse distance makes infinity a regular
/// value.
struct PointLight {
  Vec3d direction;              ///< Unit vector from the body's centre to the light, probe frame.
  double inverse_distance = 0;  ///< 1/m; 0: distant.
  Rgb irradiance{};             ///< At the body's centre, at normal incidence.
};

struct LightModel {
  /// Irradiance of the ambient light at a normal: ambient[0] + dot((ambient[1], ambient[2], ambient[3]), normal).
  std::array<Rgb, 4> ambient{};
  std::vector<PointLight> lights;  ///< Strongest first.
};

/// Irradiance at `position` (m, from the body's centre) with `normal`, for a point light whose irradiance at the centre
/// is 1: the cosine, clipped at the horizon, divided by the squared distance.
[[nodiscard]] inline double relative_irradiance(Vec3d direction, double inverse_distance, Vec3d position,
                                                Vec3d normal) {
  const Vec3d q = direction - position * inverse_distance;
  const double squared = dot(q, q);
  return std::max(0.0, dot(normal, q)) / (squared * std::sqrt(squared));
}

}  // namespace lightwell::marker
