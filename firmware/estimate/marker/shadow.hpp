// The table in the light of one lamp: where the body's shadow falls on it.
#pragma once

#include <span>

#include <Eigen/Core>

#include <lightwell/geometry.hpp>

#include "estimate/marker/convex_hull_2d.hpp"
#include "estimate/marker/observations.hpp"

namespace lightwell::marker {

/// Holds memory, so that one lamp after the other is tried without allocation.
class Shadow {
 public:
  /// Irradiance of each sample of the table by a lamp at direction / inverse_distance (1/m; 0: infinitely far) whose
  /// irradiance in the body's centre is one: cosine, falloff, and the share of the lamp that is seen past the body, a
  /// ramp as wide as a sample and a penumbra of a twentieth of the body's height. Where the lamp is below the table:
  /// all dark, false.
  bool light(const GroundObservations& table, std::span<const Vec3d> hull, Vec3d direction, double inverse_distance,
             Eigen::ArrayXd& out);

 private:
  ConvexHull2d outline_;
  Eigen::ArrayXd share_, squared_;
};

}  // namespace lightwell::marker
