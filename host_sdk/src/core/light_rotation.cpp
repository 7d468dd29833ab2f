#include "core/light_rotation.hpp"

#include <cmath>

#include <lightwell/uncertain_pose.hpp>

namespace lightwell::core {

std::array<float, 3> transport_covariance(const std::array<float, 3>& covariance, Vec3f from, Quat q, Vec3f to) {
  const auto old_basis = tangent_basis(vec_cast<double>(from));
  const auto new_basis = tangent_basis(vec_cast<double>(to));
  const Vec3d u = rotate(q, old_basis[0]), v = rotate(q, old_basis[1]);
  const double uu = covariance[0], uv = covariance[1], vv = covariance[2];
  const auto moment = [&](Vec3d a, Vec3d b) {
    return uu * dot(u, a) * dot(u, b) + uv * (dot(u, a) * dot(v, b) + dot(v, a) * dot(u, b)) +
           vv * dot(v, a) * dot(v, b);
  };
  return {static_cast<float>(moment(new_basis[0], new_basis[0])),
          static_cast<float>(moment(new_basis[0], new_basis[1])),
          static_cast<float>(moment(new_basis[1], new_basis[1]))};
}

Light rotate_light(const Light& light, Quat q) {
  Light out = light;
  out.direction = vec_cast<float>(normalized(rotate(q, vec_cast<double>(light.direction))));
  out.direction_covariance = transport_covariance(light.direction_covariance, light.direction, q, out.direction);
  return out;
}

std::array<float, 3> add_pose_noise(const Light& light, const PoseCovariance& covariance) {
  const auto [uu, uv, vv] = direction_covariance(vec_cast<double>(light.direction), covariance);
  const auto& own = light.direction_covariance;
  if (!std::isfinite(uu)) return {static_cast<float>(uu), 0, static_cast<float>(vv)};
  return {own[0] + static_cast<float>(uu), own[1] + static_cast<float>(uv), own[2] + static_cast<float>(vv)};
}

}  // namespace lightwell::core
