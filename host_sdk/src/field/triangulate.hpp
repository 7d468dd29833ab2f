// The point that several rays meet at, with its covariance, by linear least squares.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include <lightwell/geometry.hpp>

#include "field/views.hpp"

namespace lightwell::field {

/// Symmetric 3x3 matrix: xx, xy, xz, yy, yz, zz.
using Symmetric3 = std::array<double, 6>;

/// a' m b.
[[nodiscard]] double quadratic(const Symmetric3& m, Vec3d a, Vec3d b);
/// m v.
[[nodiscard]] Vec3d product(const Symmetric3& m, Vec3d v);
/// Zeros if it is singular.
[[nodiscard]] Symmetric3 inverted(const Symmetric3& m);

struct Triangulation {
  Vec3d point;
  Symmetric3 covariance{};
};

/// Minimises the squared distances of the point to the rays over their variances (sigma_rad times the distance)², and
/// to measured distances. nullopt where the rays do not determine a point in front of all origins, 0.15 m away at
/// least.
[[nodiscard]] std::optional<Triangulation> triangulate(std::span<const Observation> observations,
                                                       std::span<const std::size_t> chosen);

}  // namespace lightwell::field
