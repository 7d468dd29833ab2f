#include "estimate/marker/shadow.hpp"

#include <algorithm>

namespace lightwell::marker {
namespace {

/// Of the way to the lamp (whose length is about one): what a point of the body is further below it than so much has
/// its shadow at a finite place. A lamp that is lower than the point throws the shadow without end; then it ends far
/// outside of all samples.
constexpr double kMinElevation = 0.01;

}  // namespace

bool Shadow::light(const GroundObservations& table, std::span<const Vec3d> hull, Vec3d direction,
                   double inverse_distance, Eigen::ArrayXd& out) {
  out.setZero(table.size());
  const auto [u, v] = tangent_basis(table.normal);
  const double elevation = dot(direction, table.normal);
  // All samples lie in one plane, so that all are as far below the lamp.
  const double rise = elevation - dot(table.point, table.normal) * inverse_distance;
  if (!(rise > 0)) return false;
  outline_.clear();
  for (const Vec3d& p : hull) {
    // Towards the lamp from p, scaled by the inverse distance so that infinity is no special case.
    const Vec3d to_lamp = direction - p * inverse_distance;
    const Vec3d on_table =
        p - to_lamp * (dot(p - table.point, table.normal) / std::max(kMinElevation, dot(to_lamp, table.normal))) -
        table.point;
    outline_.add(dot(on_table, u), dot(on_table, v));
  }
  if (!outline_.close()) return false;
  outline_.outside(table.u, table.v, share_);
  const double width = 1.2 * table.step_m + 0.05 * table.height();
  share_ = (share_ / width + 0.5).max(0.0).min(1.0);
  share_ = share_ * share_ * (3 - 2 * share_);
  const Vec3d& d = direction;
  const double w = inverse_distance;
  squared_ = (d.x - table.x * w).square() + (d.y - table.y * w).square() + (d.z - table.z * w).square();
  out = share_ * rise / (squared_ * squared_.sqrt());
  return true;
}

}  // namespace lightwell::marker
