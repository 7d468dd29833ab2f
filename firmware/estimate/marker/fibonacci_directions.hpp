// Evenly spaced directions on the sphere.
#pragma once

#include <vector>

#include <lightwell/fibonacci_lattice.hpp>

namespace lightwell::marker {

/// The `count` directions of fibonacci_direction(), from +Y to -Y.
[[nodiscard]] inline std::vector<Vec3d> fibonacci_directions(int count) {
  std::vector<Vec3d> out;
  for (int i = 0; i < count; ++i) {
    const Vec3d d = fibonacci_direction(i, count);
    out.push_back({d.y, d.z, d.x});
  }
  return out;
}

}  // namespace lightwell::marker
