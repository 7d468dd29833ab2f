// Irradiance of the ground plane by one point light, with the body's shadow.
#pragma once

#include <span>

#include <Eigen/Core>

#include <lightwell/geometry.hpp>

#include "estimate/marker/convex_hull_2d.hpp"
#include "estimate/marker/observations.hpp"

namespace lightwell::marker {

/// Reuses its memory from call to call.
class Shadow {
 public:
  /// Irradiance of each ground sample by a light at direction / inverse_distance (1/m; 0: distant) whose irradiance at
  /// the body's centre is 1: cosine, falloff, and visibility past the body. The edge of the shadow is a smooth step as
  /// wide as 1.2 samples plus 0.05 times the height of the body's centre. Returns false and zeros where the light is
  /// below the plane or the outline of the shadow is degenerate.
  bool compute_irradiance(const GroundObservations& ground, std::span<const Vec3d> hull, Vec3d direction,
                          double inverse_distance, Eigen::ArrayXd& out);

 private:
  ConvexHull2d outline_;
  Eigen::ArrayXd visibility_, squared_;
};

}  // namespace lightwell::marker
