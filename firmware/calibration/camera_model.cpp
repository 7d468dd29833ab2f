#include "calibration/camera_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

#include <lightwell/equirect.hpp>

namespace lightwell {

namespace {

using KannalaBrandt = KannalaBrandtParameters;
using DoubleSphere = DoubleSphereParameters;
using Equirectangular = EquirectangularParameters;
using std::numbers::pi;

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
// clang 14 does not deduce an aggregate's arguments by itself.
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

// An angle that rounding put behind the end of the domain still counts as the end: what project()
// gives for the last direction must come back from unproject().
constexpr double kEdgeTolerance = 1e-12;

double radius(const KannalaBrandt& k, double theta) {
  const double t = theta * theta;
  return theta * (1 + t * (k.k1 + t * (k.k2 + t * (k.k3 + t * k.k4))));
}

double slope(const KannalaBrandt& k, double theta) {
  const double t = theta * theta;
  return 1 + t * (3 * k.k1 + t * (5 * k.k2 + t * (7 * k.k3 + t * 9 * k.k4)));
}

/// The angle where r(theta) stops growing, at most `end`.
double domain_end(const KannalaBrandt& k, double end) {
  // The slope is a polynomial of fourth degree in theta²: steps of a thousandth of the domain
  // cannot step over a dip that matters.
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

/// Usenko et al. 2018, eq. 43 to 45: z > -w2 |p|. For xi < 0 that reaches a little past the fold,
/// so the fold counts too: the radius, as a function of the angle psi at the second sphere's
/// centre, stops growing (alpha > 1/2) or becomes infinite at cos psi = -w1, which is this z on the
/// first.
double domain_end(const DoubleSphere& d, double end) {
  const double w1 = d.alpha <= 0.5 ? d.alpha / (1 - d.alpha) : (1 - d.alpha) / d.alpha;
  const double w2 = (w1 + d.xi) / std::sqrt(2 * w1 * d.xi + d.xi * d.xi + 1);
  const double bend = 1 - w1 * w1;
  const double fold_z = -d.xi * bend - w1 * std::sqrt(1 - d.xi * d.xi * bend);
  // The end itself does not belong to it.
  return std::min(end, std::acos(std::clamp(std::max(-w2, fold_z), -1.0, 1.0)) - 1e-9);
}

double domain_end(const Equirectangular& /*unused*/, double /*end*/) { return pi; }

/// The angle that has this radius: Newton's method, kept inside a bracket that bisection shrinks.
std::optional<double> angle_of(const KannalaBrandt& k, double wanted, double end) {
  const double last = radius(k, end);
  if (!(wanted <= last * (1 + kEdgeTolerance))) return std::nullopt;
  if (wanted >= last) return end;
  double low = 0, high = end, theta = std::min(wanted, end);
  for (int i = 0; i < 100; ++i) {
    const double excess = radius(k, theta) - wanted;
    (excess > 0 ? high : low) = theta;
    double next = theta - excess / slope(k, theta);
    if (!(next >= low && next <= high)) next = (low + high) / 2;
    const double step = std::abs(next - theta);
    theta = next;
    if (step < 1e-15) break;
  }
  return theta;
}

PixelPosition pixel_at(double fx, double fy, double cx, double cy, double mx, double my) {
  return {fx * mx + cx, fy * my + cy};
}

std::optional<PixelPosition> project_with(const KannalaBrandt& k, Vec3d d, double theta) {
  const double across = std::hypot(d.x, d.y);
  if (across == 0) {
    // Straight behind there is no azimuth, hence no one pixel.
    if (d.z < 0) return std::nullopt;
    return PixelPosition{k.cx, k.cy};
  }
  const double scale = radius(k, theta) / across;
  return pixel_at(k.fx, k.fy, k.cx, k.cy, scale * d.x, scale * d.y);
}

/// Usenko et al. 2018, eq. 40 to 42, for a unit vector.
std::optional<PixelPosition> project_with(const DoubleSphere& s, Vec3d d, double /*theta*/) {
  const double shifted = s.xi + d.z;
  const double d2 = std::sqrt(d.x * d.x + d.y * d.y + shifted * shifted);
  const double denominator = s.alpha * d2 + (1 - s.alpha) * shifted;
  if (!(denominator > 0)) return std::nullopt;
  return pixel_at(s.fx, s.fy, s.cx, s.cy, d.x / denominator, d.y / denominator);
}

std::optional<Vec3d> unproject_with(const KannalaBrandt& k, PixelPosition p, double end) {
  const double mx = (p.x - k.cx) / k.fx, my = (p.y - k.cy) / k.fy;
  const double r = std::hypot(mx, my);
  if (r == 0) return Vec3d{0, 0, 1};
  const std::optional<double> theta = angle_of(k, r, end);
  if (!theta) return std::nullopt;
  const double across = std::sin(*theta) / r;
  return Vec3d{across * mx, across * my, std::cos(*theta)};
}

/// Usenko et al. 2018, eq. 46 to 49.
std::optional<Vec3d> unproject_with(const DoubleSphere& s, PixelPosition p, double end) {
  const double mx = (p.x - s.cx) / s.fx, my = (p.y - s.cy) / s.fy;
  const double r2 = mx * mx + my * my;
  const double under_root = 1 - (2 * s.alpha - 1) * r2;
  if (!(under_root >= 0)) return std::nullopt;
  const double mz = (1 - s.alpha * s.alpha * r2) / (s.alpha * std::sqrt(under_root) + 1 - s.alpha);
  const double root = mz * mz + (1 - s.xi * s.xi) * r2;
  if (!(root >= 0)) return std::nullopt;
  const double scale = (mz * s.xi + std::sqrt(root)) / (mz * mz + r2);
  const Vec3d d = normalized(Vec3d{scale * mx, scale * my, scale * mz - s.xi});
  const double theta = std::atan2(std::hypot(d.x, d.y), d.z);
  if (!(theta <= end * (1 + kEdgeTolerance))) return std::nullopt;
  return d;
}

}  // namespace

CameraModel::CameraModel(const LensParameters& lens)
    : model_(lens.model),
      width_(lens.width),
      height_(lens.height),
      max_angle_(
          std::visit([&](const auto& m) { return domain_end(m, std::min(lens.max_angle_rad, pi)); },
                     lens.model)) {}

std::optional<PixelPosition> CameraModel::project(Vec3d direction_cv) const {
  const Vec3d d = normalized(direction_cv);
  if (d == Vec3d{}) return std::nullopt;
  const double theta = std::atan2(std::hypot(d.x, d.y), d.z);
  if (theta > max_angle_ * (1 + kEdgeTolerance)) return std::nullopt;
  return std::visit(
      Overloaded{
          [&](const Equirectangular&) -> std::optional<PixelPosition> {
            // The house's mapping is written for axes with y up and z back.
            const EquirectUv uv = equirect_uv({d.x, -d.y, -d.z});
            return PixelPosition{uv.u * width_ - 0.5, uv.v * height_ - 0.5};
          },
          [&](const auto& m) { return project_with(m, d, std::min(theta, max_angle_)); },
      },
      model_);
}

std::optional<Vec3d> CameraModel::unproject(PixelPosition pixel) const {
  if (!std::isfinite(pixel.x) || !std::isfinite(pixel.y)) return std::nullopt;
  return std::visit(Overloaded{
                        [&](const Equirectangular&) -> std::optional<Vec3d> {
                          const double u = (pixel.x + 0.5) / width_, v = (pixel.y + 0.5) / height_;
                          if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1)) return std::nullopt;
                          const Vec3d d = equirect_direction(u, v);
                          return Vec3d{d.x, -d.y, -d.z};
                        },
                        [&](const auto& m) { return unproject_with(m, pixel, max_angle_); },
                    },
                    model_);
}

}  // namespace lightwell
