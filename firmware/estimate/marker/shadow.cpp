#include "estimate/marker/shadow.hpp"

#include <algorithm>

namespace lightwell::marker {
namespace {

/// Smallest elevation of the light above a point of the body, relative to the distance. Below it, the point's shadow is
/// at infinity or does not exist; the limit moves it far outside of all samples.
constexpr double kMinElevation = 0.01;

}  // namespace

bool Shadow::compute_irradiance(const GroundObservations& ground, std::span<const Vec3d> hull, Vec3d direction,
                                double inverse_distance, Eigen::ArrayXd& out) {
  out.setZero(ground.size());
  const auto [u, v] = tangent_basis(ground.normal);
  const double elevation = dot(direction, ground.normal);
  // All samples lie in one plane, so that the light's height above it is the same for all.
  const double rise = elevation - dot(ground.point, ground.normal) * inverse_distance;
  if (!(rise > 0)) return false;
  outline_.clear();
  for (const Vec3d& p : hull) {
    // Vector from p to the light, times the inverse distance: finite for distant lights, too.
    const Vec3d to_light = direction - p * inverse_distance;
    const Vec3d on_ground =
        p - to_light * (dot(p - ground.point, ground.normal) / std::max(kMinElevation, dot(to_light, ground.normal))) -
        ground.point;
    outline_.add(dot(on_ground, u), dot(on_ground, v));
  }
  if (!outline_.close()) return false;
  outline_.signed_distance(ground.u, ground.v, visibility_);
  const double width = 1.2 * ground.step_m + 0.05 * ground.height();
  visibility_ = (visibility_ / width + 0.5).max(0.0).min(1.0);
  visibility_ = visibility_ * visibility_ * (3 - 2 * visibility_);
  const Vec3d& d = direction;
  const double w = inverse_distance;
  squared_ = (d.x - ground.x * w).square() + (d.y - ground.y * w).square() + (d.z - ground.z * w).square();
  out = visibility_ * rise / (squared_ * squared_.sqrt());
  return true;
}

}  // namespace lightwell::marker
