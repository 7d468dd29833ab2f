#include "relight/direction_blend.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::relight {
namespace {

/// A triangle whose plane is nearer to the origin spans more than 150 degrees: its lights say little about its middle.
constexpr double kMinFacetDistance = 0.26;

/// Lights of a regular arrangement lie on common planes; this moves each by 1e-5 so that hull facets are triangles.
Vec3d in_general_position(Vec3d direction, std::size_t i) {
  return direction + fibonacci_direction(static_cast<int>(i * 37 % 1009), 1009) * 1e-5;
}

Vec3d direction_from(Vec3d centre, const BasisLight& light) {
  const Vec3d to = light.distance == LightDistance::distant ? light.place : light.place - centre;
  const Vec3d unit = normalized(to);
  return dot(unit, unit) > 0 ? unit : Vec3d{0, 1, 0};
}

std::vector<Vec3d> directions_of(std::span<const BasisLight> basis, Vec3d centre) {
  std::vector<Vec3d> out;
  for (const BasisLight& light : basis) out.push_back(direction_from(centre, light));
  return out;
}

}  // namespace

DirectionBlend::DirectionBlend(std::vector<Vec3d> directions) : directions_(std::move(directions)) {
  std::vector<Vec3d> points;
  for (std::size_t i = 0; i < directions_.size(); ++i) points.push_back(in_general_position(directions_[i], i));
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j)
      for (std::size_t k = j + 1; k < points.size(); ++k) {
        Vec3d normal = normalized(cross(points[j] - points[i], points[k] - points[i]));
        double offset = dot(normal, points[i]);
        if (offset < 0) normal = -normal, offset = -offset;
        if (offset < kMinFacetDistance) continue;
        const bool outermost = std::ranges::all_of(points, [&](Vec3d p) { return dot(normal, p) <= offset + 1e-12; });
        const Vec3d &a = directions_[i], &b = directions_[j], &c = directions_[k];
        const double determinant = dot(a, cross(b, c));
        if (!outermost || std::abs(determinant) < 1e-9) continue;
        facets_.push_back(
            {{i, j, k},
             {cross(b, c) * (1 / determinant), cross(c, a) * (1 / determinant), cross(a, b) * (1 / determinant)}});
      }
}

std::size_t DirectionBlend::nearest(Vec3d direction) const {
  return static_cast<std::size_t>(
      std::ranges::max_element(directions_, {}, [&](Vec3d d) { return dot(d, direction); }) - directions_.begin());
}

double DirectionBlend::nearest_rad(Vec3d direction) const {
  return angle_between(directions_[nearest(direction)], direction);
}

DirectionBlend::Weights DirectionBlend::at(Vec3d direction) const {
  for (const Facet& facet : facets_) {
    const double a = dot(facet.inverse[0], direction), b = dot(facet.inverse[1], direction),
                 c = dot(facet.inverse[2], direction);
    // A margin for the moves of in_general_position().
    if (std::min({a, b, c}) < -1e-4) continue;
    return {facet.light,
            {static_cast<float>(std::max(a, 0.0)), static_cast<float>(std::max(b, 0.0)),
             static_cast<float>(std::max(c, 0.0))}};
  }
  return {{nearest(direction)}, {1, 0, 0}};
}

BasisSphere::BasisSphere(std::span<const BasisLight> basis, Vec3d centre)
    : centre_(centre), blend_(directions_of(basis, centre)) {
  double count = 0;
  for (const BasisLight& light : basis)
    if (light.distance == LightDistance::finite) radius_ += length(light.place - centre), ++count;
  if (count > 0) radius_ /= count;
}

DirectionBlend::Weights BasisSphere::at(Vec3d from, Vec3d pattern) const {
  const Vec3d ray = normalized(pattern - from);
  if (!(radius_ > 0)) return blend_.at(ray);
  const Vec3d start = from - centre_;
  const double b = dot(start, ray), c = dot(start, start) - radius_ * radius_;
  // From outside of the sphere the ray may miss it: then its direction counts.
  if (c > 0) return blend_.at(ray);
  return blend_.at(normalized(start + ray * (std::sqrt(b * b - c) - b)));
}

}  // namespace lightwell::relight
