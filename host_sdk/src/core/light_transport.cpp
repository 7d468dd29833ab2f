#include "core/light_transport.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

namespace lightwell::core {

std::array<float, 3> carried_covariance(const std::array<float, 3>& covariance, Vec3f from, Quat q, Vec3f to) {
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

Light turned(const Light& light, Quat q) {
  Light out = light;
  out.direction = vec_cast<float>(normalized(rotate(q, vec_cast<double>(light.direction))));
  out.direction_covariance = carried_covariance(light.direction_covariance, light.direction, q, out.direction);
  return out;
}

std::array<float, 3> doubted(const Light& light, const PoseCovariance& covariance) {
  // A turn by the small vector w moves the direction d by w x d: along u by w.v, along v by -w.u.
  const auto [u, v] = tangent_basis(vec_cast<double>(light.direction));
  const std::array<double, 3> along_u{v.x, v.y, v.z}, along_v{-u.x, -u.y, -u.z};
  const auto moment = [&](const std::array<double, 3>& a, const std::array<double, 3>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        const double weight = a[i] * b[j];
        // An axis that does not move the direction may be unknown.
        if (std::abs(weight) > 1e-12) sum += weight * covariance[i][j];
      }
    return sum;
  };
  const double uu = moment(along_u, along_u), uv = moment(along_u, along_v), vv = moment(along_v, along_v);
  if (!std::isfinite(uu + uv + vv)) {
    constexpr float kUnknown = std::numeric_limits<float>::infinity();
    return {kUnknown, 0, kUnknown};
  }
  const auto& own = light.direction_covariance;
  return {own[0] + static_cast<float>(uu), own[1] + static_cast<float>(uv), own[2] + static_cast<float>(vv)};
}

}  // namespace lightwell::core
