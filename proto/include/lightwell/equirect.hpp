// Equirectangular images: -Z at the centre, +X to the right of it, +Y at the top.
#pragma once

#include <cmath>
#include <numbers>

#include <lightwell/geometry.hpp>

namespace lightwell {

/// Direction at u, v in [0, 1]: phi = 2 pi (u - 1/2), theta = pi (1/2 - v),
/// d = (cos theta sin phi, sin theta, -cos theta cos phi).
[[nodiscard]] inline Vec3d equirect_direction(double u, double v) {
  const double phi = 2 * std::numbers::pi * (u - 0.5), theta = std::numbers::pi * (0.5 - v);
  return {std::cos(theta) * std::sin(phi), std::sin(theta), -std::cos(theta) * std::cos(phi)};
}

struct EquirectUv {
  double u = 0, v = 0;
};

/// The inverse: u in [0, 1), v in [0, 1]. At a pole u is 1/2.
[[nodiscard]] inline EquirectUv equirect_uv(Vec3d d) {
  const double phi = std::atan2(d.x, 0.0 - d.z);  // Not -d.z: at a pole that is -0, for which atan2 gives pi.
  const double theta = std::atan2(d.y, std::hypot(d.x, d.z));
  double u = phi / (2 * std::numbers::pi) + 0.5;
  if (u >= 1) u -= 1;
  return {u, 0.5 - theta / std::numbers::pi};
}

/// Exact solid angle of a pixel in row j of a W x H image, sr.
[[nodiscard]] inline double equirect_solid_angle(int j, int width, int height) {
  const double top = std::numbers::pi * (0.5 - static_cast<double>(j) / height);
  const double bottom = std::numbers::pi * (0.5 - static_cast<double>(j + 1) / height);
  return 2 * std::numbers::pi / width * (std::sin(top) - std::sin(bottom));
}

}  // namespace lightwell
