// Evenly distributed directions.
#pragma once

#include <cmath>
#include <numbers>

#include <lightwell/geometry.hpp>

namespace lightwell {

/// Unit vector i of `count` on a spiral from +Z to -Z, each representing 4 pi / count sr: the rings have equal area,
/// and each is rotated by the golden angle relative to the previous one. The Fibonacci lattice of Gonzalez 2010,
/// "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices", with half a step at the poles.
[[nodiscard]] inline Vec3d fibonacci_direction(int i, int count) {
  const double z = 1 - (2.0 * i + 1) / count, ring = std::sqrt((1 - z) * (1 + z));
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0)), azimuth = golden_angle * i;
  return {ring * std::cos(azimuth), ring * std::sin(azimuth), z};
}

}  // namespace lightwell
