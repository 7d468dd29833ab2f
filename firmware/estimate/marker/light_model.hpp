// Light as few numbers: what comes from all around, and lamps that are distant or near.
//   Lamp, LightModel
//   relative_irradiance        how much of a lamp's irradiance a small surface gets
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <lightwell/geometry.hpp>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Its place is direction / inverse_distance from the body's centre: infinity is no special case.
struct PointLight {
  Vec3d direction;              ///< Unit, towards it.
  double inverse_distance = 0;  ///< 1/m; 0: infinitely far.
  Rgb irradiance{};             ///< In the body's centre, at normal incidence.
};

struct LightModel {
  /// Irradiance of light from all around, bands 0 and 1: ambient[0] + dot((ambient[1], ambient[2], ambient[3]),
  /// normal).
  std::array<Rgb, 4> ambient{};
  std::vector<PointLight> lights;  ///< Strongest first.
};

/// Irradiance at `position` with `normal`, for a lamp whose irradiance in the centre is one: the cosine, clipped at the
/// horizon, over the square of the distance.
[[nodiscard]] inline double relative_irradiance(Vec3d direction, double inverse_distance, Vec3d position, Vec3d normal) {
  const Vec3d q = direction - position * inverse_distance;
  const double squared = dot(q, q);
  return std::max(0.0, dot(normal, q)) / (squared * std::sqrt(squared));
}

}  // namespace lightwell::marker
