#include "wire_position.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "messages.hpp"

namespace lightwell {
namespace {

constexpr double kUnit_m = 1e-4;
constexpr double kMaxUnits = std::numeric_limits<std::uint32_t>::max();
/// Keeps positions in the range of float.
constexpr double kMaxTranslation_m = 1e6;
/// Of a unit quaternion's squared length, for rotations that were composed of many.
constexpr double kUnitTolerance = 1e-6;
constexpr const char* kOrigin = "descriptor: T_probe_origin";

Status invalid(const char* what) { return invalid_argument(std::string("descriptor: ") + what); }

/// A float has 24 bits: without the tolerance, the standard deviation 3e-4F would be rounded up to 4 units.
double rounded_up(float sigma_m) { return std::ceil(static_cast<double>(sigma_m) / kUnit_m * (1 - 1e-7)); }

}  // namespace

Status wire_pose_problem(const Pose& pose, const char* who) {
  const auto& [q, t] = pose;
  if (!(std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) < kUnitTolerance))
    return invalid_argument(std::string(who) + " has no unit quaternion");
  for (const double v : {t.x, t.y, t.z})
    if (!(std::abs(v) <= kMaxTranslation_m))
      return invalid_argument(std::string(who) + ": tx, ty, tz must be within 1e6 m");
  return {};
}

Result<Pose> wire_pose_from(const v1::Pose& m, const char* who) {
  Pose out = pose_from(m);
  if (const Status s = pose_problem(out); !s.ok()) return s.in(who);
  out.rotation = out.rotation.normalized();
  if (const Status s = wire_pose_problem(out, who); !s.ok()) return s;
  return out;
}

Status origin_problem(const Pose& T_probe_origin) { return wire_pose_problem(T_probe_origin, kOrigin); }

Status distance_problem(const Light& light) {
  if (light.distance_m == 0 && light.distance_sigma_m == 0) return {};
  const double units = std::nearbyint(static_cast<double>(light.distance_m) / kUnit_m);
  if (!(units >= 1 && units <= kMaxUnits)) return invalid("a light's distance is not within 1e-4 m and 429 km");
  if (!(light.distance_sigma_m > 0 && rounded_up(light.distance_sigma_m) <= kMaxUnits))
    return invalid("the standard deviation of a light's distance is not within 0 and 429 km");
  return {};
}

void fill_origin(const Pose& T_probe_origin, v1::Pose& m) { fill_pose(T_probe_origin, m); }

void fill_distance(const Light& light, v1::Light& m) {
  if (!(light.distance_m > 0)) return;
  m.set_distance_e4(static_cast<std::uint32_t>(std::nearbyint(static_cast<double>(light.distance_m) / kUnit_m)));
  m.set_distance_sigma_e4(static_cast<std::uint32_t>(std::max(1.0, rounded_up(light.distance_sigma_m))));
}

Result<Pose> origin_from(const v1::LightingDescriptor& m) {
  if (!m.has_t_probe_origin()) return Pose{};
  return wire_pose_from(m.t_probe_origin(), kOrigin);
}

Status read_distance(const v1::Light& m, Light& light) {
  if ((m.distance_e4() == 0) != (m.distance_sigma_e4() == 0))
    return invalid("light.distance_e4 without distance_sigma_e4, or the reverse");
  light.distance_m = static_cast<float>(m.distance_e4() * kUnit_m);
  light.distance_sigma_m = static_cast<float>(m.distance_sigma_e4() * kUnit_m);
  return {};
}

}  // namespace lightwell
