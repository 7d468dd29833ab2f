// Irradiance by a square of known radiance, in double.
#pragma once

#include <cmath>
#include <cstddef>

#include <lightwell/captured_plane.hpp>
#include <lightwell/geometry.hpp>

#include "support/captured_planes.hpp"

namespace lightwell::test {

inline constexpr double kSquareSide_m = 0.2;  ///< Of linear_plane().

/// The integral of L(point, direction to the receiver) n·l cos / r² over the square by n x n midpoints.
template <class L>
double square_irradiance(Vec3d receiver, Vec3d normal, const L& radiance, int n = 400) {
  double sum = 0;
  const double step = kSquareSide_m / n;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Vec3d at{(i + 0.5) * step - kSquareSide_m / 2, (j + 0.5) * step - kSquareSide_m / 2, 0};
      const Vec3d to = receiver - at;
      const double square = dot(to, to), distance = std::sqrt(square);
      const double cosine = -dot(normal, to) / distance;
      if (cosine > 0) sum += step * step * radiance(at, to * (1 / distance)) * cosine * to.z / (square * distance);
    }
  return sum;
}

/// linear_plane() of an edge that 8 divides with a bright patch of an eighth of its side, beside the middle.
inline CapturedPlane plane_with_patch(int edge) {
  CapturedPlane out = linear_plane(edge);
  for (int row = 5 * edge / 16; row < 7 * edge / 16; ++row)
    for (int column = 10 * edge / 16; column < 12 * edge / 16; ++column)
      out.texture.radiance[static_cast<std::size_t>(edge * row + column)] = {8, 8, 8};
  return out;
}

/// Green of the texel at a point.
inline double texel_green(const CapturedPlane& plane, Vec3d at) {
  const int edge = plane.texture.edge;
  const int column = static_cast<int>((at.x / kSquareSide_m + 0.5) * edge);
  const int row = static_cast<int>((0.5 - at.y / kSquareSide_m) * edge);
  return double{plane.texture.radiance[static_cast<std::size_t>(edge * row + column)].g};
}

}  // namespace lightwell::test
