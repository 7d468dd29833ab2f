// The camera models, as templates over a scalar type T: double or ceres::Jet, so that a solver differentiates
// the functions from which the tables are made. Axes _cv: x right, y down, z forward.
//   project()        the pixel of a direction; does not check the domain
//   unproject()      the unit vector of a pixel; empty if no direction within `max_angle` (rad) has this pixel
//   max_angle_rad()  the end of the domain, at most `limit`, rad
//   from()           the camera with the parameters `p`, in the order of kNames
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <variant>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/equirect.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell {

/// Relative tolerance of the domain's end: unproject() must accept the pixel of project() for the last direction.
inline constexpr double kDomainTolerance = 1e-12;

/// Whether the angle of a direction from the z axis is at most `max_angle`, rad.
[[nodiscard]] inline bool is_within(Vec3d direction, double max_angle) {
  if (max_angle >= std::numbers::pi) return true;
  return std::atan2(std::hypot(direction.x, direction.y), direction.z) <= max_angle * (1 + kDomainTolerance);
}

/// The angle up to which `is_valid(angle)` holds, at most `limit`, rad. It is evaluated at a thousand angles, then
/// bisected: a shorter interval of invalid angles is not detected.
template <class IsValid>
[[nodiscard]] double largest_valid_angle(double limit, const IsValid& is_valid) {
  constexpr int kSteps = 1000, kBisections = 60;
  double low = 0;
  for (int i = 1; i <= kSteps; ++i) {
    double high = limit * i / kSteps;
    if (is_valid(high)) {
      low = high;
      continue;
    }
    for (int n = 0; n < kBisections; ++n) {
      const double middle = (low + high) / 2;
      (is_valid(middle) ? low : high) = middle;
    }
    return low;
  }
  return limit;
}

/// Kannala & Brandt 2006, "A Generic Camera Model and Calibration Method for Conventional, Wide-Angle, and Fish-Eye
/// Lenses", eq. 6, with the coefficients of OpenCV's fisheye module: the radius in the picture is a polynomial of the
/// angle theta from the axis.
///
/// Parameters: fx, fy, cx, cy (px), k1, k2, k3, k4.
/// Projection, with rho = sqrt(x² + y²) and theta = atan2(rho, z):
///   r(theta) = theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸)   eq. 6, scaled by its first coefficient
///   u = fx r x / rho + cx                                                  v = fy r y / rho + cy
/// Domain: up to the first zero of r' = dr/dtheta.
/// Inverse: theta from r by Newton's method; direction (x sin theta / r, y sin theta / r, cos theta) with
///   x = (u - cx) / fx, y = (v - cy) / fy, r = sqrt(x² + y²).
template <class T>
struct KannalaBrandtCamera {
  using Parameters = KannalaBrandtParameters;
  static constexpr std::array kNames{"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  static constexpr std::size_t kParameters = kNames.size();

  T fx, fy, cx, cy, k1, k2, k3, k4;

  template <class S>
  [[nodiscard]] static KannalaBrandtCamera from(const S* p) {
    return {T(p[0]), T(p[1]), T(p[2]), T(p[3]), T(p[4]), T(p[5]), T(p[6]), T(p[7])};
  }

  /// False for zero and for the negative z axis, which have no pixel.
  [[nodiscard]] bool project(const T& x, const T& y, const T& z, T& u, T& v) const {
    using std::atan2, std::sqrt;
    const T across2 = x * x + y * y;
    // Near the axis r / across is 1 / z to the precision of double, and the square root has no derivative at zero.
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

  [[nodiscard]] std::optional<Vec3<T>> unproject(T u, T v, T max_angle) const {
    const T mx = (u - cx) / fx, my = (v - cy) / fy;
    const T r = std::hypot(mx, my);
    if (r == 0) return Vec3<T>{0, 0, 1};
    const std::optional<T> theta = angle(r, max_angle);
    if (!theta) return std::nullopt;
    const T across = std::sin(*theta) / r;
    return Vec3<T>{across * mx, across * my, std::cos(*theta)};
  }

  /// The slope is a polynomial of fourth degree in theta²: a dip that largest_valid_angle() misses is negligible.
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
    if (!(wanted <= last * (1 + kDomainTolerance))) return std::nullopt;
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

/// Usenko, Demmel & Cremers 2018, "The Double Sphere Camera Model", eq. 40 to 51: the point is projected onto a unit
/// sphere, then onto a second one whose centre is shifted by xi, then through a pinhole that is shifted by
/// alpha / (1 - alpha).
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
template <class T>
struct DoubleSphereCamera {
  using Parameters = DoubleSphereParameters;
  static constexpr std::array kNames{"fx", "fy", "cx", "cy", "xi", "alpha"};
  static constexpr std::size_t kParameters = kNames.size();

  T fx, fy, cx, cy, xi, alpha;

  template <class S>
  [[nodiscard]] static DoubleSphereCamera from(const S* p) {
    return {T(p[0]), T(p[1]), T(p[2]), T(p[3]), T(p[4]), T(p[5])};
  }

  /// False where q is not positive, and for zero.
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

  /// For xi < 0 eq. 43 reaches slightly past the fold of the projection, so the fold is a limit, too: the radius, as a
  /// function of the angle psi at the second sphere's centre, has its maximum (alpha > 1/2) or becomes infinite (alpha
  /// <= 1/2) at cos psi = -w1; fold_z is that point's z on the first sphere.
  [[nodiscard]] double max_angle_rad(double limit) const requires std::same_as<T, double> {
    const double w1 = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
    const double w2 = (w1 + xi) / std::sqrt(2 * w1 * xi + xi * xi + 1);
    const double bend = 1 - w1 * w1;
    const double fold_z = -xi * bend - w1 * std::sqrt(1 - xi * xi * bend);
    // The domain is open: exclude the end itself.
    return std::min(limit, std::acos(std::clamp(std::max(-w2, fold_z), -1.0, 1.0)) - 1e-9);
  }
};

/// Mei & Rives 2007, "Single View Point Omnidirectional Camera Calibration from Planar Grids", eq. 2 to 6 and 9,
/// without skew, with the distortion of OpenCV's omnidir module (Brown 1966): the unit sphere is projected from a point
/// xi behind its centre, then distorted radially (k1, k2) and tangentially (p1, p2). With xi = 0 it is a pinhole.
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
template <class T>
struct MeiCamera {
  using Parameters = MeiParameters;
  static constexpr std::array kNames{"fx", "fy", "cx", "cy", "xi", "k1", "k2", "p1", "p2"};
  static constexpr std::size_t kParameters = kNames.size();

  T fx, fy, cx, cy, xi, k1, k2, p1, p2;

  template <class S>
  [[nodiscard]] static MeiCamera from(const S* p) {
    return {T(p[0]), T(p[1]), T(p[2]), T(p[3]), T(p[4]), T(p[5]), T(p[6]), T(p[7]), T(p[8])};
  }

  /// False where q is not positive, and for zero.
  [[nodiscard]] bool project(const T& x, const T& y, const T& z, T& u, T& v) const {
    using std::sqrt;
    const T denominator = z + xi * sqrt(x * x + y * y + z * z);
    if (!(denominator > T(0))) return false;
    const auto [nx, ny] = distorted(x / denominator, y / denominator);
    u = fx * nx + cx;
    v = fy * ny + cy;
    return true;
  }

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

  /// The distortion must be injective at each of 72 azimuths.
  [[nodiscard]] double max_angle_rad(double limit) const requires std::same_as<T, double> {
    // The domain is open: exclude the end itself.
    const double end = std::min(limit, std::acos(xi > 1 ? -1 / xi : -xi) - 1e-9);
    if (!is_distorted()) return end;
    std::array<std::array<double, 2>, 72> azimuths;
    for (std::size_t i = 0; i < azimuths.size(); ++i) {
      const double phi = 2 * std::numbers::pi * static_cast<double>(i) / azimuths.size();
      azimuths[i] = {std::cos(phi), std::sin(phi)};
    }
    return largest_valid_angle(end, [&](double theta) {
      const double r = std::sin(theta) / (std::cos(theta) + xi);
      for (const auto& [cosine, sine] : azimuths) {
        const DistortionJacobian j = distortion_jacobian(r * cosine, r * sine);
        if (!(j.xx > 0 && j.yy > 0 && j.determinant() > 0)) return false;
      }
      return true;
    });
  }

 private:
  [[nodiscard]] bool is_distorted() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0; }

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
    if (!is_distorted()) return std::array{nx, ny};
    const T wanted = std::hypot(nx, ny);
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

/// A stitched picture of the whole sphere (lightwell/equirect.hpp): longitude and latitude are linear in the pixel; z
/// is the centre of the picture. Not a template, because it has no parameters to estimate.
///
/// Parameters: none that a solver estimates; width and height of the picture, px.
/// Projection:
///   u = width (atan2(x, z) / (2 pi) + 1/2) - 1/2     v = height (atan2(y, sqrt(x² + z²)) / pi + 1/2) - 1/2
/// Domain: every direction but zero; to pi.
/// Inverse, with phi = 2 pi ((u + 1/2) / width - 1/2) and theta = pi ((v + 1/2) / height - 1/2):
///   direction = (cos theta sin phi, sin theta, cos theta cos phi)
struct EquirectangularCamera {
  using Parameters = EquirectangularParameters;
  static constexpr std::size_t kParameters = 0;

  int width, height;

  [[nodiscard]] bool project(double x, double y, double z, double& u, double& v) const {
    // equirect_uv() expects axes with y up and z backward.
    const EquirectUv uv = equirect_uv({x, -y, -z});
    u = uv.u * width - 0.5;
    v = uv.v * height - 0.5;
    return true;
  }

  /// Empty outside the picture.
  [[nodiscard]] std::optional<Vec3d> unproject(double u, double v, double /*max_angle*/) const {
    const double right = (u + 0.5) / width, down = (v + 0.5) / height;
    if (!(right >= 0 && right <= 1 && down >= 0 && down <= 1)) return std::nullopt;
    const Vec3d d = equirect_direction(right, down);
    return Vec3d{d.x, -d.y, -d.z};
  }
};

// The parameters of a model, for solvers, in the order of its struct and of kNames. Not for equirectangular models.

/// The numbers of a parameters struct.
template <class Parameters>
[[nodiscard]] auto values_of(const Parameters& parameters) {
  return std::bit_cast<std::array<double, sizeof(Parameters) / sizeof(double)>>(parameters);
}

/// The parameters struct with the given numbers.
template <class Parameters>
[[nodiscard]] Parameters from_values(const double* values) {
  std::array<double, sizeof(Parameters) / sizeof(double)> copy;
  std::copy_n(values, copy.size(), copy.begin());
  return std::bit_cast<Parameters>(copy);
}

/// Calls `f.template operator()<Camera>(parameters)` with the camera class template of these parameters.
template <class F>
decltype(auto) with_camera(const ModelParameters& model, F&& f) {
  if (const auto* k = std::get_if<KannalaBrandtParameters>(&model))
    return f.template operator()<KannalaBrandtCamera>(*k);
  if (const auto* d = std::get_if<DoubleSphereParameters>(&model)) return f.template operator()<DoubleSphereCamera>(*d);
  return f.template operator()<MeiCamera>(std::get<MeiParameters>(model));
}

/// The numbers of a model.
[[nodiscard]] inline std::vector<double> parameters_of(const ModelParameters& model) {
  return with_camera(model, []<template <class> class Camera>(const auto& parameters) {
    const auto values = values_of(parameters);
    return std::vector<double>(values.begin(), values.end());
  });
}

/// The names of the parameters, as in calibration.proto.
[[nodiscard]] inline std::vector<const char*> parameter_names(const ModelParameters& model) {
  return with_camera(model, []<template <class> class Camera>(const auto& /*parameters*/) {
    const auto& names = Camera<double>::kNames;
    return std::vector<const char*>(names.begin(), names.end());
  });
}

/// A model of the same kind as `like` with the given numbers, as many as parameters_of(like).
[[nodiscard]] inline ModelParameters with_parameters(const ModelParameters& like, const double* numbers) {
  return with_camera(like, [&]<template <class> class Camera>(const auto& /*parameters*/) -> ModelParameters {
    return from_values<typename Camera<double>::Parameters>(numbers);
  });
}

}  // namespace lightwell
