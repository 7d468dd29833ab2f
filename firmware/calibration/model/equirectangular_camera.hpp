// Camera model of a stitched picture of the whole sphere (lightwell/equirect.hpp).
#pragma once

#include <cstddef>
#include <optional>

#include <lightwell/calibration.hpp>
#include <lightwell/equirect.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell {

/// Longitude and latitude are linear in the pixel. T: float or double; computes in double. Axes _cv: x right, y down, z
/// forward; z is the centre of the picture.
///
/// Parameters: none that a solver estimates; width and height of the picture, px.
/// Projection:
///   u = width (atan2(x, z) / (2 pi) + 1/2) - 1/2     v = height (atan2(y, sqrt(x² + z²)) / pi + 1/2) - 1/2
/// Domain: every direction but zero; to pi.
/// Inverse, with phi = 2 pi ((u + 1/2) / width - 1/2) and theta = pi ((v + 1/2) / height - 1/2):
///   direction = (cos theta sin phi, sin theta, cos theta cos phi)
/// Jacobian, with rho² = x² + z², d² = x² + y² + z², a = width / (2 pi), b = height / pi:
///   du/d(x, y, z) = a (z, 0, -x) / rho²     dv/d(x, y, z) = b (-x y / rho, rho, -y z / rho) / d²
template <class T>
struct EquirectangularCamera {
  using Parameters = EquirectangularParameters;
  static constexpr std::size_t kParameters = 0;

  int width, height;

  /// True.
  [[nodiscard]] bool project(T x, T y, T z, T& u, T& v) const {
    // equirect_uv() expects axes with y up and z backward.
    const EquirectUv uv = equirect_uv({static_cast<double>(x), -static_cast<double>(y), -static_cast<double>(z)});
    u = static_cast<T>(uv.u * width - 0.5);
    v = static_cast<T>(uv.v * height - 0.5);
    return true;
  }

  /// A unit vector; empty outside the picture.
  [[nodiscard]] std::optional<Vec3<T>> unproject(T u, T v, T /*max_angle*/) const {
    const double right = (static_cast<double>(u) + 0.5) / width, down = (static_cast<double>(v) + 0.5) / height;
    if (!(right >= 0 && right <= 1 && down >= 0 && down <= 1)) return std::nullopt;
    const Vec3d d = equirect_direction(right, down);
    return vec_cast<T>(Vec3d{d.x, -d.y, -d.z});
  }
};

}  // namespace lightwell
