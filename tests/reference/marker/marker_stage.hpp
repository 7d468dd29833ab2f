// A simple arrangement of camera and upright body, with poses and directions by azimuth and elevation.
//   MarkerStage
#pragma once

#include <cmath>

#include <lightwell/geometry.hpp>

namespace lightwell::reference {

/// The camera is at the probe's origin and looks along -Z at the body's origin. Azimuths are around the body's +Y axis,
/// which is up: 0 towards the camera, pi/2 to the camera's right, pi behind the body.
struct MarkerStage {
  double distance_m = 0.6;     ///< From the camera to the body's origin.
  double elevation_rad = 0.5;  ///< Elevation of the camera above the horizon, seen from the body.
  double turn_rad = 0;         ///< Rotation of the body about its +Y axis: azimuth of its +Z axis.

  [[nodiscard]] Quat tilt() const { return Quat::about({1, 0, 0}, elevation_rad); }
  [[nodiscard]] Pose probe_body() const {
    return {(tilt() * Quat::about({0, 1, 0}, turn_rad)).normalized(), {0, 0, -distance_m}};
  }
  /// Unit vector, probe frame.
  [[nodiscard]] Vec3d up() const { return rotate(tilt(), Vec3d{0, 1, 0}); }
  [[nodiscard]] Vec3d direction(double azimuth_rad, double elevation_above_table_rad) const {
    const double flat = std::cos(elevation_above_table_rad);
    return rotate(
        tilt(), Vec3d{flat * std::sin(azimuth_rad), std::sin(elevation_above_table_rad), flat * std::cos(azimuth_rad)});
  }
  /// The point at a distance from the body's origin in that direction, probe frame.
  [[nodiscard]] Vec3d place(double azimuth_rad, double elevation_above_table_rad, double from_body_m) const {
    return Vec3d{0, 0, -distance_m} + direction(azimuth_rad, elevation_above_table_rad) * from_body_m;
  }
};

}  // namespace lightwell::reference
