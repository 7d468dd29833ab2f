// Directions between lights.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/relight.hpp>

namespace lightwell::relight {

/// Vector base amplitude panning (Pulkki 1997): a direction d is the combination w1 d1 + w2 d2 + w3 d3 of the corners
/// of the triangle of lights around it. A Lambertian surface that faces all three is then shaded exactly as by the
/// light at d. Triangles are those of the convex hull; outside of them the nearest light stands for the direction.
class DirectionBlend {
 public:
  /// Unit directions, at least one.
  explicit DirectionBlend(std::vector<Vec3d> directions);

  struct Weights {
    std::array<std::size_t, 3> light{};
    std::array<float, 3> weight{};  ///< At least 0; 0 for lights that are not used.
  };
  [[nodiscard]] Weights at(Vec3d direction) const;
  /// Angle to the nearest light, rad.
  [[nodiscard]] double nearest_rad(Vec3d direction) const;

 private:
  struct Facet {
    std::array<std::size_t, 3> light{};
    std::array<Vec3d, 3> inverse;  ///< Rows of the inverse of the matrix whose columns are the corners.
  };
  [[nodiscard]] std::size_t nearest(Vec3d direction) const;

  std::vector<Vec3d> directions_;
  std::vector<Facet> facets_;
};

/// The basis lights as seen from a point.
class BasisSphere {
 public:
  BasisSphere(std::span<const BasisLight> basis, Vec3d centre);

  /// The basis lights around the ray from `from` to the place of a pattern: where it crosses the sphere through the
  /// basis lights.
  [[nodiscard]] DirectionBlend::Weights at(Vec3d from, Vec3d pattern) const;
  [[nodiscard]] const DirectionBlend& blend() const { return blend_; }
  [[nodiscard]] Vec3d centre() const { return centre_; }

 private:
  Vec3d centre_;
  double radius_ = 0;  ///< 0: all are distant.
  DirectionBlend blend_;
};

}  // namespace lightwell::relight
