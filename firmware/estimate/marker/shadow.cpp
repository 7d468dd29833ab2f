#include "estimate/marker/shadow.hpp"

#include <algorithm>

namespace lightwell::marker {
namespace {

/// The lamp stands at least this much higher above the table than the body's highest point, as a share of its own height; of a lamp
/// that is infinitely far: the sine of its elevation.
constexpr double kAbove = 0.05;

}  // namespace

bool Shadow::light(const TableObservations& table, std::span<const Vec3d> hull, Vec3d direction, double inverse_distance, Eigen::ArrayXd& out) {
  out.setZero(table.size());
  const auto [u, v] = tangent_basis(table.normal);
  const double elevation = dot(direction, table.normal);
  if (!(elevation > kAbove)) return false;
  outline_.clear();
  for (const Vec3d& p : hull) {
    // Towards the lamp from p, scaled by the inverse distance so that infinity is no special case.
    const Vec3d to_lamp = direction - p * inverse_distance;
    const double rise = dot(to_lamp, table.normal);
    if (!(rise > kAbove * elevation)) return false;
    const Vec3d on_table = p - to_lamp * (dot(p - table.point, table.normal) / rise) - table.point;
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
  // All samples lie in one plane, so that all are as far below the lamp.
  const double rise = elevation - dot(table.point, table.normal) * w;
  out = share_ * std::max(0.0, rise) / (squared_ * squared_.sqrt());
  return true;
}

}  // namespace lightwell::marker
