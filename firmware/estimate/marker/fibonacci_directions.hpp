// Evenly spaced directions on the sphere.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include <lightwell/geometry.hpp>

namespace lightwell::marker {

/// `count` unit vectors on a spiral from pole to pole (Fibonacci lattice), each representing 4 pi / count sr (Gonzalez
/// 2010, "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices").
[[nodiscard]] inline std::vector<Vec3d> fibonacci_directions(int count) {
  std::vector<Vec3d> out;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double y = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - y * y);
    out.push_back({r * std::sin(golden * i), y, r * std::cos(golden * i)});
  }
  return out;
}

}  // namespace lightwell::marker
