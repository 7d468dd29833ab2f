// Camera model of Mei & Rives 2007, "Single View Point Omnidirectional Camera Calibration from Planar Grids", eq. 2 to
// 6 and 9, without skew, with the distortion of OpenCV's omnidir module (Brown 1966). With xi = 0 it is a pinhole.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/model/camera_domain.hpp"

namespace lightwell {

/// The unit sphere is projected from a point xi behind its centre, then distorted radially (k1, k2) and tangentially
/// (p1, p2). T: float, double or ceres::Jet. Axes _cv: x right, y down, z forward.
///
/// Parameters: fx, fy, cx, cy (px), xi, k1, k2, p1, p2; xi >= 0.
/// Projection, eq. 2 to 6, with d = sqrt(x² + y² + z²) and q = z + xi d:
///   mx = x / q     my = y / q     r² = mx² + my²     l = 1 + k1 r² + k2 r⁴
///   nx = l mx + 2 p1 mx my + p2 (r² + 2 mx²)         u = fx nx + cx
///   ny = l my + p1 (r² + 2 my²) + 2 p2 mx my         v = fy ny + cy
/// Domain: to cos theta = -1 / xi, where the ray touches the sphere (xi > 1), or cos theta = -xi, where q = 0
/// (xi <= 1); or less, to where the distortion folds the picture.
/// Inverse: m from n by Newton's method; then eq. 9:
///   direction = (xi + sqrt(1 + (1 - xi²) r²)) / (1 + r²) (mx, my, 1) - (0, 0, xi)
/// Jacobian, with e = 2 k1 + 4 k2 r²; v follows with fy and ny:
///   dnx/dmx = l + e mx² + 2 p1 my + 6 p2 mx     dny/dmy = l + e my² + 6 p1 my + 2 p2 mx
///   dnx/dmy = dny/dmx = e mx my + 2 p1 mx + 2 p2 my
///   dq = (0, 0, 1) + xi (x, y, z) / d     dmx = ((1, 0, 0) - mx dq) / q     dmy = ((0, 1, 0) - my dq) / q
///   du/d(x, y, z) = fx (dnx/dmx dmx + dnx/dmy dmy)     du/dxi = -fx d / q (mx dnx/dmx + my dnx/dmy)
///   du/dfx = nx     du/dcx = 1     du/dki = fx mx r^(2 i)     du/dp1 = fx 2 mx my     du/dp2 = fx (r² + 2 mx²)
template <class T>
struct MeiCamera {
  using Parameters = MeiParameters;
  static constexpr std::array kNames{"fx", "fy", "cx", "cy", "xi", "k1", "k2", "p1", "p2"};
  static constexpr std::size_t kParameters = kNames.size();

  T fx, fy, cx, cy, xi, k1, k2, p1, p2;

  /// The camera with the parameters `p`, in the order of kNames.
  template <class S>
  [[nodiscard]] static MeiCamera from(const S* p) {
    return {T(p[0]), T(p[1]), T(p[2]), T(p[3]), T(p[4]), T(p[5]), T(p[6]), T(p[7]), T(p[8])};
  }

  /// False where q is not positive, and for zero. Does not check the domain.
  [[nodiscard]] bool project(const T& x, const T& y, const T& z, T& u, T& v) const {
    using std::sqrt;
    const T denominator = z + xi * sqrt(x * x + y * y + z * z);
    if (!(denominator > T(0))) return false;
    const auto [nx, ny] = distorted(x / denominator, y / denominator);
    u = fx * nx + cx;
    v = fy * ny + cy;
    return true;
  }

  /// A unit vector; empty if no direction within `max_angle` (rad) has this pixel.
  [[nodiscard]] std::optional<Vec3<T>> unproject(T u, T v, T max_angle) const {
    const T farthest = std::sin(max_angle) / (std::cos(max_angle) + xi) * (1 + T(1e-3)) + T(1e-3);
    const auto m = undistorted((u - cx) / fx, (v - cy) / fy, farthest);
    if (!m) return std::nullopt;
    const auto [mx, my] = *m;
    const T r2 = mx * mx + my * my, root = 1 + (1 - xi * xi) * r2;
    if (!(root >= 0)) return std::nullopt;
    const T scale = (xi + std::sqrt(root)) / (1 + r2);
    const Vec3<T> d = normalized(Vec3<T>{scale * mx, scale * my, scale - xi});
    return is_within(d, max_angle) ? std::optional(d) : std::nullopt;
  }

  /// The end of the domain, at most `limit`, rad. The distortion must be injective at each of 72 azimuths.
  [[nodiscard]] double max_angle_rad(double limit) const requires std::same_as<T, double> {
    // The domain is open: exclude the end itself.
    const double end = std::min(limit, std::acos(xi > 1 ? -1 / xi : -xi) - 1e-9);
    return largest_valid_angle(end, [this](double theta) {
      constexpr int kAzimuths = 72;
      const double r = std::sin(theta) / (std::cos(theta) + xi);
      for (int i = 0; i < kAzimuths; ++i) {
        const double phi = 2 * std::numbers::pi * i / kAzimuths;
        const DistortionJacobian j = distortion_jacobian(r * std::cos(phi), r * std::sin(phi));
        if (!(j.xx > 0 && j.yy > 0 && j.determinant() > 0)) return false;
      }
      return true;
    });
  }

 private:
  /// d(nx, ny) / d(mx, my), which is symmetric.
  struct DistortionJacobian {
    T xx, xy, yy;
    [[nodiscard]] T determinant() const { return xx * yy - xy * xy; }
  };

  [[nodiscard]] DistortionJacobian distortion_jacobian(T x, T y) const {
    const T r2 = x * x + y * y, along = 1 + r2 * (k1 + r2 * k2), steeper = 2 * k1 + 4 * k2 * r2;
    return {along + x * x * steeper + 2 * p1 * y + 6 * p2 * x, x * y * steeper + 2 * p1 * x + 2 * p2 * y,
            along + y * y * steeper + 6 * p1 * y + 2 * p2 * x};
  }

  /// (nx, ny) of the point (x, y) of the plane at distance one.
  [[nodiscard]] std::array<T, 2> distorted(const T& x, const T& y) const {
    const T r2 = x * x + y * y, along = T(1) + r2 * (k1 + r2 * k2), xy2 = T(2) * x * y;
    return {x * along + p1 * xy2 + p2 * (r2 + T(2) * x * x), y * along + p1 * (r2 + T(2) * y * y) + p2 * xy2};
  }

  /// Inverse of distorted() by Newton's method; empty if it does not converge.
  [[nodiscard]] std::optional<std::array<T, 2>> undistorted(T nx, T ny, T farthest) const {
    const T wanted = std::hypot(nx, ny);
    if (wanted == 0 && p1 == 0 && p2 == 0) return std::array<T, 2>{};
    // Initial radius by bisection: without the tangential terms the radius is monotonic up to `farthest`.
    T low = 0, high = farthest;
    for (int i = 0; i < 30; ++i) {
      const T middle = (low + high) / 2, m2 = middle * middle;
      (middle * (1 + m2 * (k1 + m2 * k2)) < wanted ? low : high) = middle;
    }
    const T start = wanted > 0 ? low / wanted : T(0);
    T x = nx * start, y = ny * start;
    for (int i = 0; i < 30; ++i) {
      const auto [px, py] = distorted(x, y);
      const T dx = px - nx, dy = py - ny;
      const DistortionJacobian j = distortion_jacobian(x, y);
      const T determinant = j.determinant();
      if (!(determinant > 0)) return std::nullopt;
      const T sx = (j.yy * dx - j.xy * dy) / determinant, sy = (j.xx * dy - j.xy * dx) / determinant;
      x -= sx, y -= sy;
      if (std::abs(sx) + std::abs(sy) <= 8 * std::numeric_limits<T>::epsilon() * (1 + std::abs(x) + std::abs(y)))
        return std::array{x, y};
    }
    return std::nullopt;
  }
};

}  // namespace lightwell
