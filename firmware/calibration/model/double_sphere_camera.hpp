// Camera model of Usenko, Demmel & Cremers 2018, "The Double Sphere Camera Model", eq. 40 to 51.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <optional>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/model/camera_domain.hpp"

namespace lightwell {

/// The point is projected onto a unit sphere, then onto a second one whose centre is shifted by xi, then through a
/// pinhole that is shifted by alpha / (1 - alpha). T: float, double or ceres::Jet. Axes _cv: x right, y down, z
/// forward.
///
/// Parameters: fx, fy, cx, cy (px), xi, alpha; -1 < xi < 1, 0 <= alpha <= 1.
/// Projection, eq. 40 to 42:
///   d1 = sqrt(x² + y² + z²)     s = xi d1 + z     d2 = sqrt(x² + y² + s²)     q = alpha d2 + (1 - alpha) s
///   u = fx x / q + cx           v = fy y / q + cy
/// Domain, eq. 43 to 45: z > -w2 d1, but not beyond the fold of the projection (max_angle_rad()).
/// Inverse, eq. 46 to 50, where eq. 51 (r² <= 1 / (2 alpha - 1) for alpha > 1/2) holds:
///   mx = (u - cx) / fx    my = (v - cy) / fy    r² = mx² + my²
///   mz = (1 - alpha² r²) / (alpha sqrt(1 - (2 alpha - 1) r²) + 1 - alpha)
///   direction = (mz xi + sqrt(mz² + (1 - xi²) r²)) / (mz² + r²) (mx, my, mz) - (0, 0, xi)
/// Jacobian, with the gradient of q; v follows with fy, y and (0, 1, 0):
///   ds = xi (x, y, z) / d1 + (0, 0, 1)     dq = alpha ((x, y, 0) + s ds) / d2 + (1 - alpha) ds
///   du/d(x, y, z) = fx ((1, 0, 0) - x / q dq) / q         du/dfx = x / q     du/dcx = 1
///   du/dxi = -fx x d1 (alpha s / d2 + 1 - alpha) / q²     du/dalpha = -fx x (d2 - s) / q²
template <class T>
struct DoubleSphereCamera {
  using Parameters = DoubleSphereParameters;
  static constexpr std::array kNames{"fx", "fy", "cx", "cy", "xi", "alpha"};
  static constexpr std::size_t kParameters = kNames.size();

  T fx, fy, cx, cy, xi, alpha;

  /// The camera with the parameters `p`, in the order of kNames.
  template <class S>
  [[nodiscard]] static DoubleSphereCamera from(const S* p) {
    return {T(p[0]), T(p[1]), T(p[2]), T(p[3]), T(p[4]), T(p[5])};
  }

  /// False where q is not positive, and for zero. Does not check the domain.
  [[nodiscard]] bool project(const T& x, const T& y, const T& z, T& u, T& v) const {
    using std::sqrt;
    const T across2 = x * x + y * y;
    const T shifted = xi * sqrt(across2 + z * z) + z;
    const T denominator = alpha * sqrt(across2 + shifted * shifted) + (T(1) - alpha) * shifted;
    if (!(denominator > T(0))) return false;
    u = fx * x / denominator + cx;
    v = fy * y / denominator + cy;
    return true;
  }

  /// A unit vector; empty if no direction within `max_angle` (rad) has this pixel.
  [[nodiscard]] std::optional<Vec3<T>> unproject(T u, T v, T max_angle) const {
    const T mx = (u - cx) / fx, my = (v - cy) / fy, r2 = mx * mx + my * my;
    const T under_root = 1 - (2 * alpha - 1) * r2;
    if (!(under_root >= 0)) return std::nullopt;
    const T mz = (1 - alpha * alpha * r2) / (alpha * std::sqrt(under_root) + 1 - alpha);
    const T root = mz * mz + (1 - xi * xi) * r2;
    if (!(root >= 0)) return std::nullopt;
    const T scale = (mz * xi + std::sqrt(root)) / (mz * mz + r2);
    const Vec3<T> d = normalized(Vec3<T>{scale * mx, scale * my, scale * mz - xi});
    return is_within(d, max_angle) ? std::optional(d) : std::nullopt;
  }

  /// The end of the domain, at most `limit`, rad. For xi < 0 eq. 43 reaches slightly past the fold of the projection,
  /// so the fold is a limit, too: the radius, as a function of the angle psi at the second sphere's centre, has its
  /// maximum (alpha > 1/2) or becomes infinite (alpha <= 1/2) at cos psi = -w1; fold_z is that point's z on the first
  /// sphere.
  [[nodiscard]] double max_angle_rad(double limit) const requires std::same_as<T, double> {
    const double w1 = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
    const double w2 = (w1 + xi) / std::sqrt(2 * w1 * xi + xi * xi + 1);
    const double bend = 1 - w1 * w1;
    const double fold_z = -xi * bend - w1 * std::sqrt(1 - xi * xi * bend);
    // The domain is open: exclude the end itself.
    return std::min(limit, std::acos(std::clamp(std::max(-w2, fold_z), -1.0, 1.0)) - 1e-9);
  }
};

}  // namespace lightwell
