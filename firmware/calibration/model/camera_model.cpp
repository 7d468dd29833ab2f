#include "calibration/model/camera_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <lightwell/equirect.hpp>

#include "calibration/model/projection.hpp"

namespace lightwell {
namespace {

using std::numbers::pi;

/// Tolerance of the domain's end for rounding errors, so that unproject() accepts the pixel that project() returns for
/// the last direction.
template <class T>
constexpr T kEdgeTolerance = T(1e-12);
template <>
constexpr float kEdgeTolerance<float> = 4e-6F;

// Largest angles of the domains, always computed in double.

double slope(const KannalaBrandtParameters& k, double theta) {
  const double t = theta * theta;
  return 1 + t * (3 * k.k1 + t * (5 * k.k2 + t * (7 * k.k3 + t * 9 * k.k4)));
}

/// The angle up to which r(theta) increases, at most `end`.
double domain_end(const KannalaBrandtParameters& k, double end) {
  // The slope is a polynomial of fourth degree in theta²: at steps of a thousandth of the domain, an undetected dip
  // would be negligible.
  constexpr int kSteps = 1000;
  double low = 0;
  for (int i = 1; i <= kSteps; ++i) {
    double high = end * i / kSteps;
    if (slope(k, high) > 0) {
      low = high;
      continue;
    }
    for (int n = 0; n < 60; ++n) {
      const double middle = (low + high) / 2;
      (slope(k, middle) > 0 ? low : high) = middle;
    }
    return low;
  }
  return end;
}

/// Usenko et al. 2018, eq. 43 to 45: z > -w2 |p|. For xi < 0 this reaches slightly past the fold of the projection, so
/// the fold is a limit, too: the radius, as a function of the angle psi at the second sphere's centre, has its maximum
/// (alpha > 1/2) or becomes infinite (alpha <= 1/2) at cos psi = -w1; fold_z is that point's z on the first sphere.
double domain_end(const DoubleSphereParameters& d, double end) {
  const double w1 = d.alpha <= 0.5 ? d.alpha / (1 - d.alpha) : (1 - d.alpha) / d.alpha;
  const double w2 = (w1 + d.xi) / std::sqrt(2 * w1 * d.xi + d.xi * d.xi + 1);
  const double bend = 1 - w1 * w1;
  const double fold_z = -d.xi * bend - w1 * std::sqrt(1 - d.xi * d.xi * bend);
  // The domain is open: exclude the end itself.
  return std::min(end, std::acos(std::clamp(std::max(-w2, fold_z), -1.0, 1.0)) - 1e-9);
}

/// Determinant of the Jacobian of the distortion at (x, y); positive where the projection is injective.
double distortion_determinant(const MeiParameters& m, double x, double y) {
  const double r2 = x * x + y * y, along = 1 + r2 * (m.k1 + r2 * m.k2), steeper = 2 * m.k1 + 4 * m.k2 * r2;
  const double ux = along + x * x * steeper + 2 * m.p1 * y + 6 * m.p2 * x;
  const double uy = x * y * steeper + 2 * m.p1 * x + 2 * m.p2 * y;
  const double vy = along + y * y * steeper + 6 * m.p1 * y + 2 * m.p2 * x;
  return ux > 0 && vy > 0 ? ux * vy - uy * uy : -1;
}

/// The angle at which the view ray is tangent to the sphere (xi > 1: cos theta = -1/xi) or the plane coordinates become
/// infinite (cos theta = -xi); or a smaller one, at which the distortion folds the picture at any azimuth.
double domain_end(const MeiParameters& m, double end) {
  constexpr int kSteps = 1000, kAzimuths = 72;
  end = std::min(end, std::acos(m.xi > 1 ? -1 / m.xi : -m.xi) - 1e-9);
  const auto folded = [&](double theta) {
    const double r = std::sin(theta) / (std::cos(theta) + m.xi);
    for (int i = 0; i < kAzimuths; ++i) {
      const double phi = 2 * pi * i / kAzimuths;
      if (!(distortion_determinant(m, r * std::cos(phi), r * std::sin(phi)) > 0)) return true;
    }
    return false;
  };
  double low = 0;
  for (int i = 1; i <= kSteps; ++i) {
    double high = end * i / kSteps;
    if (!folded(high)) {
      low = high;
      continue;
    }
    for (int n = 0; n < 40; ++n) {
      const double middle = (low + high) / 2;
      (folded(middle) ? high : low) = middle;
    }
    return low;
  }
  return end;
}

double domain_end(const EquirectangularParameters& /*unused*/, double /*end*/) { return pi; }

/// Inverse of r(theta): Newton's method, safeguarded by bisection.
template <class T>
std::optional<T> kannala_brandt_angle(const T* p, T wanted, T end) {
  const T last = KannalaBrandtModel::radius(p, end);
  if (!(wanted <= last * (1 + kEdgeTolerance<T>))) return std::nullopt;
  if (wanted >= last) return end;
  T low = 0, high = end, theta = std::min(wanted, end);
  for (int i = 0; i < 100; ++i) {
    const T t = theta * theta;
    const T steep = 1 + t * (3 * p[4] + t * (5 * p[5] + t * (7 * p[6] + t * 9 * p[7])));
    const T excess = KannalaBrandtModel::radius(p, theta) - wanted;
    (excess > 0 ? high : low) = theta;
    T next = theta - excess / steep;
    if (!(next >= low && next <= high)) next = (low + high) / 2;
    const T step = std::abs(next - theta);
    theta = next;
    if (step < 4 * std::numeric_limits<T>::epsilon()) break;
  }
  return theta;
}

template <class T>
std::optional<Vec3<T>> unproject_kannala_brandt(const T* p, T mx, T my, T end) {
  const T r = std::hypot(mx, my);
  if (r == 0) return Vec3<T>{0, 0, 1};
  const std::optional<T> theta = kannala_brandt_angle(p, r, end);
  if (!theta) return std::nullopt;
  const T across = std::sin(*theta) / r;
  return Vec3<T>{across * mx, across * my, std::cos(*theta)};
}

/// Usenko et al. 2018, eq. 46 to 49.
template <class T>
std::optional<Vec3<T>> unproject_double_sphere(const T* p, T mx, T my) {
  const T xi = p[4], alpha = p[5], r2 = mx * mx + my * my;
  const T under_root = 1 - (2 * alpha - 1) * r2;
  if (!(under_root >= 0)) return std::nullopt;
  const T mz = (1 - alpha * alpha * r2) / (alpha * std::sqrt(under_root) + 1 - alpha);
  const T root = mz * mz + (1 - xi * xi) * r2;
  if (!(root >= 0)) return std::nullopt;
  const T scale = (mz * xi + std::sqrt(root)) / (mz * mz + r2);
  return normalized(Vec3<T>{scale * mx, scale * my, scale * mz - xi});
}

/// Inverse of the distortion: the plane point that is distorted to (u, v), by Newton's method; empty if it does not
/// converge.
template <class T>
std::optional<BasicPixelPosition<T>> mei_undistorted(const T* p, T u, T v, T farthest) {
  const T wanted = std::hypot(u, v);
  if (wanted == 0 && p[7] == 0 && p[8] == 0) return BasicPixelPosition<T>{};
  // Initial radius by bisection: without the tangential terms the radius is monotonic up to `farthest`.
  T low = 0, high = farthest;
  for (int i = 0; i < 30; ++i) {
    const T middle = (low + high) / 2, m2 = middle * middle;
    (middle * (1 + m2 * (p[5] + m2 * p[6])) < wanted ? low : high) = middle;
  }
  const T start = wanted > 0 ? low / wanted : T(0);
  T x = u * start, y = v * start;
  for (int i = 0; i < 30; ++i) {
    T du, dv;
    MeiModel::distort(p, x, y, du, dv);
    du -= u, dv -= v;
    const T r2 = x * x + y * y, along = 1 + r2 * (p[5] + r2 * p[6]), steeper = 2 * p[5] + 4 * p[6] * r2;
    const T ux = along + x * x * steeper + 2 * p[7] * y + 6 * p[8] * x;
    const T uy = x * y * steeper + 2 * p[7] * x + 2 * p[8] * y;
    const T vy = along + y * y * steeper + 6 * p[7] * y + 2 * p[8] * x;
    const T determinant = ux * vy - uy * uy;
    if (!(determinant > 0)) return std::nullopt;
    const T sx = (vy * du - uy * dv) / determinant, sy = (ux * dv - uy * du) / determinant;
    x -= sx, y -= sy;
    if (std::abs(sx) + std::abs(sy) <= 8 * std::numeric_limits<T>::epsilon() * (1 + std::abs(x) + std::abs(y)))
      return BasicPixelPosition<T>{x, y};
  }
  return std::nullopt;
}

/// Mei & Rives 2007, eq. 9: inverse of the projection of the sphere.
template <class T>
std::optional<Vec3<T>> unproject_mei(const T* p, T mx, T my, T end) {
  const T xi = p[4];
  const T farthest = std::sin(end) / (std::cos(end) + xi) * (1 + T(1e-3)) + T(1e-3);
  const auto m = mei_undistorted(p, mx, my, farthest);
  if (!m) return std::nullopt;
  const T r2 = m->x * m->x + m->y * m->y, root = 1 + (1 - xi * xi) * r2;
  if (!(root >= 0)) return std::nullopt;
  const T scale = (xi + std::sqrt(root)) / (1 + r2);
  return normalized(Vec3<T>{scale * m->x, scale * m->y, scale - xi});
}

template <class Model, class T>
void keep(const typename Model::Parameters& parameters, std::array<T, 9>& out) {
  const auto values = Model::values(parameters);
  for (std::size_t i = 0; i < values.size(); ++i) out[i] = static_cast<T>(values[i]);
}

}  // namespace

template <class T>
BasicCameraModel<T>::BasicCameraModel(const LensParameters& lens)
    : kind_(Kind::equirectangular),
      width_(lens.width),
      height_(lens.height),
      max_angle_(
          std::visit([&](const auto& m) { return domain_end(m, std::min(lens.max_angle_rad, pi)); }, lens.model)) {
  if (const auto* k = std::get_if<KannalaBrandtParameters>(&lens.model)) {
    kind_ = Kind::kannala_brandt;
    keep<KannalaBrandtModel>(*k, p_);
  } else if (const auto* d = std::get_if<DoubleSphereParameters>(&lens.model)) {
    kind_ = Kind::double_sphere;
    keep<DoubleSphereModel>(*d, p_);
  } else if (const auto* m = std::get_if<MeiParameters>(&lens.model)) {
    kind_ = Kind::mei;
    keep<MeiModel>(*m, p_);
  }
}

template <class T>
std::optional<BasicPixelPosition<T>> BasicCameraModel<T>::project(Vec3<T> direction_cv) const {
  const Vec3<T> d = normalized(direction_cv);
  if (d == Vec3<T>{}) return std::nullopt;
  if (kind_ == Kind::equirectangular) {
    // equirect_uv() expects axes with y up and z backward.
    const EquirectUv uv = equirect_uv({static_cast<double>(d.x), -static_cast<double>(d.y), -static_cast<double>(d.z)});
    return BasicPixelPosition<T>{static_cast<T>(uv.u * width_ - 0.5), static_cast<T>(uv.v * height_ - 0.5)};
  }
  const T theta = std::atan2(std::hypot(d.x, d.y), d.z);
  if (theta > static_cast<T>(max_angle_) * (1 + kEdgeTolerance<T>)) return std::nullopt;
  BasicPixelPosition<T> out;
  const bool known = kind_ == Kind::kannala_brandt ? KannalaBrandtModel::project(p_.data(), d.x, d.y, d.z, out.x, out.y)
                     : kind_ == Kind::double_sphere ? DoubleSphereModel::project(p_.data(), d.x, d.y, d.z, out.x, out.y)
                                                    : MeiModel::project(p_.data(), d.x, d.y, d.z, out.x, out.y);
  if (!known) return std::nullopt;
  return out;
}

template <class T>
std::optional<Vec3<T>> BasicCameraModel<T>::unproject(BasicPixelPosition<T> pixel) const {
  if (!std::isfinite(pixel.x) || !std::isfinite(pixel.y)) return std::nullopt;
  if (kind_ == Kind::equirectangular) {
    const double u = (static_cast<double>(pixel.x) + 0.5) / width_, v = (static_cast<double>(pixel.y) + 0.5) / height_;
    if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1)) return std::nullopt;
    const Vec3d d = equirect_direction(u, v);
    return vec_cast<T>(Vec3d{d.x, -d.y, -d.z});
  }
  const auto end = static_cast<T>(max_angle_);
  const T mx = (pixel.x - p_[2]) / p_[0], my = (pixel.y - p_[3]) / p_[1];
  if (kind_ == Kind::kannala_brandt) return unproject_kannala_brandt(p_.data(), mx, my, end);
  const std::optional<Vec3<T>> d =
      kind_ == Kind::double_sphere ? unproject_double_sphere(p_.data(), mx, my) : unproject_mei(p_.data(), mx, my, end);
  if (!d || !(std::atan2(std::hypot(d->x, d->y), d->z) <= end * (1 + kEdgeTolerance<T>))) return std::nullopt;
  return d;
}

template class BasicCameraModel<double>;
template class BasicCameraModel<float>;

}  // namespace lightwell
