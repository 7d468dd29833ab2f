// Parametric light model: ambient light of SH bands 0 and 1, and distant or near point lights; its error model.
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

// Standard deviations of the observations, in addition to each sample's own sigma.

/// Of a sample, relative to its irradiance: texture, blur, falloff within a patch.
inline constexpr double kSampleRelativeSigma = 0.005;
/// Of a sample, relative to Observations::max_irradiance(): light from the ground plane varies along a face.
inline constexpr double kSampleSigmaFloor = 0.004;
/// Shared by a surface, relative to its mean irradiance: its attitude and its paper.
inline constexpr double kSurfaceRelativeSigma = 0.007;
/// Shared by a surface, relative to Observations::max_irradiance(): interreflection between surfaces.
inline constexpr double kSurfaceSigmaFloor = 0.015;
/// Of a ground sample, relative to the plane's mean radiance: its texture, and light that the body reflects onto it.
inline constexpr double kGroundRelativeSigma = 0.03;
/// Neighbouring ground samples are correlated: this many count as one.
inline constexpr double kGroundCorrelatedSamples = 9;
/// Prior standard deviation of each linear coefficient of the ambient light, relative to its constant.
inline constexpr double kAmbientGradientSigma = 1;

}  // namespace lightwell::marker
