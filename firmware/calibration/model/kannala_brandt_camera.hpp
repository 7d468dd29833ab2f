// Camera model of Kannala & Brandt 2006, "A Generic Camera Model and Calibration Method for Conventional, Wide-Angle,
// and Fish-Eye Lenses", eq. 6, with the coefficients of OpenCV's fisheye module.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/model/camera_domain.hpp"

namespace lightwell {

/// The radius in the picture is a polynomial of the angle theta from the axis. T: float, double or ceres::Jet. Axes
/// _cv: x right, y down, z forward.
///
/// Parameters: fx, fy, cx, cy (px), k1, k2, k3, k4.
/// Projection, with rho = sqrt(x² + y²) and theta = atan2(rho, z):
///   r(theta) = theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸)   eq. 6, scaled by its first coefficient
///   u = fx r x / rho + cx                                                  v = fy r y / rho + cy
/// Domain: up to the first zero of r' = dr/dtheta.
/// Inverse: theta from r by Newton's method; direction (x sin theta / r, y sin theta / r, cos theta) with
///   x = (u - cx) / fx, y = (v - cy) / fy, r = sqrt(x² + y²).
/// Jacobian, with d² = x² + y² + z², a = r' z / d², b = r / rho; v follows with fy, x and y exchanged:
///   du/dx = fx (a x² + b y²) / rho²     du/dy = fx (a - b) x y / rho²     du/dz = -fx r' x / d²
///   du/dfx = r x / rho                  du/dcx = 1                        du/dki = fx theta^(2 i + 1) x / rho
template <class T>
struct KannalaBrandtCamera {
  using Parameters = KannalaBrandtParameters;
  static constexpr std::array kNames{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  static constexpr std::size_t kParameters = kNames.size();

  T fx, fy, cx, cy, k1, k2, k3, k4;

  /// The camera with the parameters `p`, in the order of kNames.
  template <class S>
  [[nodiscard]] static KannalaBrandtCamera from(const S* p) {
    return {T(p[0]), T(p[1]), T(p[2]), T(p[3]), T(p[4]), T(p[5]), T(p[6]), T(p[7])};
  }

  /// False for zero and for the negative z axis, which have no pixel. Does not check the domain.
  [[nodiscard]] bool project(const T& x, const T& y, const T& z, T& u, T& v) const {
    using std::atan2, std::sqrt;
    const T across2 = x * x + y * y;
    // Near the axis r / across tends to 1 / z, and the square root has no derivative at zero. Below this threshold the
    // next term of the series is below the precision of double.
    T scale;
    if (across2 <= T(1e-16) * z * z) {
      if (!(z > T(0))) return false;
      scale = T(1) / z;
    } else {
      const T across = sqrt(across2);
      scale = radius(atan2(across, z)) / across;
    }
    u = fx * scale * x + cx;
    v = fy * scale * y + cy;
    return true;
  }

  /// A unit vector; empty if no angle up to `max_angle` (rad) has this radius.
  [[nodiscard]] std::optional<Vec3<T>> unproject(T u, T v, T max_angle) const {
    const T mx = (u - cx) / fx, my = (v - cy) / fy;
    const T r = std::hypot(mx, my);
    if (r == 0) return Vec3<T>{0, 0, 1};
    const std::optional<T> theta = angle(r, max_angle);
    if (!theta) return std::nullopt;
    const T across = std::sin(*theta) / r;
    return Vec3<T>{across * mx, across * my, std::cos(*theta)};
  }

  /// The end of the domain, at most `limit`, rad. The slope is a polynomial of fourth degree in theta²: a dip that
  /// largest_valid_angle() does not detect is negligible.
  [[nodiscard]] double max_angle_rad(double limit) const requires std::same_as<T, double> {
    return largest_valid_angle(limit, [this](double theta) { return slope(theta) > 0; });
  }

 private:
  [[nodiscard]] T radius(const T& theta) const {
    const T t = theta * theta;
    return theta * (T(1) + t * (k1 + t * (k2 + t * (k3 + t * k4))));
  }

  /// dr/dtheta.
  [[nodiscard]] T slope(T theta) const {
    const T t = theta * theta;
    return 1 + t * (3 * k1 + t * (5 * k2 + t * (7 * k3 + t * 9 * k4)));
  }

  /// Inverse of radius() in [0, end]: Newton's method, safeguarded by bisection.
  [[nodiscard]] std::optional<T> angle(T wanted, T end) const {
    const T last = radius(end);
    if (!(wanted <= last * (1 + kDomainTolerance<T>))) return std::nullopt;
    if (wanted >= last) return end;
    T low = 0, high = end, theta = std::min(wanted, end);
    for (int i = 0; i < 100; ++i) {
      const T excess = radius(theta) - wanted;
      (excess > 0 ? high : low) = theta;
      T next = theta - excess / slope(theta);
      if (!(next >= low && next <= high)) next = (low + high) / 2;
      const T step = std::abs(next - theta);
      theta = next;
      if (step < 4 * std::numeric_limits<T>::epsilon()) break;
    }
    return theta;
  }
};

}  // namespace lightwell
