#include "mounting_message.hpp"

#include <cmath>
#include <string>

namespace lightwell {
namespace {

constexpr int kTriangle = 21;  // Upper triangle of a 6x6 matrix.

Status validate(const UncertainPose& T_world_probe) {
  const auto wrong = [](const std::string& what) { return Status(StatusCode::invalid_argument, what); };
  const auto& [q, t] = T_world_probe.pose;
  const double squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!(squared > 1e-18) || !std::isfinite(squared))
    return wrong("pose has no rotation: qx, qy, qz, qw are zero or not finite");
  if (!std::isfinite(t.x) || !std::isfinite(t.y) || !std::isfinite(t.z))
    return wrong("pose: tx, ty, tz must be finite");
  const PoseCovariance& c = T_world_probe.covariance;
  for (std::size_t r = 0; r < 6; ++r) {
    if (!(c[r][r] >= 0)) return wrong("covariance: variance " + std::to_string(r) + " must not be negative");
    for (std::size_t k = r + 1; k < 6; ++k) {
      const bool known = std::isfinite(c[r][r]) && std::isfinite(c[k][k]);
      // Rounding can make a correlation of 1 slightly larger.
      if (known ? !(c[r][k] * c[r][k] <= c[r][r] * c[k][k] * (1 + 1e-9)) : c[r][k] != 0)
        return wrong("covariance of " + std::to_string(r) + " and " + std::to_string(k) +
                     " is larger than their variances allow; with an infinite variance it must be 0");
    }
  }
  return {};
}

}  // namespace

Result<UncertainPose> mounting_from(const v1::Mounting& m) {
  const v1::Pose& p = m.pose();
  UncertainPose out{{{p.qx(), p.qy(), p.qz(), p.qw()}, {p.tx(), p.ty(), p.tz()}}, {}};
  if (m.covariance_size() != 0 && m.covariance_size() != kTriangle)
    return Status(StatusCode::invalid_argument, "covariance has " + std::to_string(m.covariance_size()) +
                                                    " numbers; it is 21, the upper triangle row by row, or none");
  int next = 0;
  for (std::size_t r = 0; r < 6 && m.covariance_size() != 0; ++r)
    for (std::size_t k = r; k < 6; ++k) out.covariance[r][k] = out.covariance[k][r] = m.covariance(next++);
  if (const Status s = validate(out); !s.ok()) return s;
  out.pose.rotation = out.pose.rotation.normalized();
  return out;
}

v1::Mounting mounting_to(const UncertainPose& T_world_probe) {
  v1::Mounting m;
  v1::Pose& p = *m.mutable_pose();
  const auto& [q, t] = T_world_probe.pose;
  p.set_qx(q.x), p.set_qy(q.y), p.set_qz(q.z), p.set_qw(q.w);
  p.set_tx(t.x), p.set_ty(t.y), p.set_tz(t.z);
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t k = r; k < 6; ++k) m.add_covariance(T_world_probe.covariance[r][k]);
  return m;
}

}  // namespace lightwell
