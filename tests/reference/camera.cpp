#include "reference/camera.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace lightwell::reference {

namespace {

/// The root of f in [low, high] by bisection; f(low) <= 0 <= f(high).
double bisect(const std::function<double(double)>& f, double low, double high) {
  for (;;) {
    const double middle = low + 0.5 * (high - low);
    if (middle <= low || middle >= high) return middle;
    (f(middle) <= 0 ? low : high) = middle;
  }
}

double theta_of(const V3& point_cv) { return std::atan2(std::hypot(point_cv.x, point_cv.y), point_cv.z); }

bool finite_and_not_zero(const V3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z) && length(v) > 0;
}

/// The pixel at `radius` from the centre on the ray's azimuth.
template <class Camera>
V2 pixel_at(const Camera& camera, const V3& point_cv, double radius) {
  const double across = std::hypot(point_cv.x, point_cv.y);
  if (across == 0) return {camera.cx, camera.cy};
  return {camera.fx * radius * point_cv.x / across + camera.cx, camera.fy * radius * point_cv.y / across + camera.cy};
}

/// Inverts a radius function that increases over 0..end.
template <class Camera>
std::optional<V3> unproject_radially(const Camera& camera, const V2& pixel, double end) {
  const double x = (pixel.x - camera.cx) / camera.fx;
  const double y = (pixel.y - camera.cy) / camera.fy;
  const double wanted = std::hypot(x, y);
  if (wanted == 0) return V3{0, 0, 1};
  if (!(wanted <= radius(camera, end))) return std::nullopt;
  const double theta = bisect([&](double t) { return radius(camera, t) - wanted; }, 0, end);
  const double across = std::sin(theta) / wanted;
  return V3{across * x, across * y, std::cos(theta)};
}

double kannala_brandt_slope(const KannalaBrandt& k, double theta) {
  const double t = theta * theta;
  return 1 + t * (3 * k.k1 + t * (5 * k.k2 + t * (7 * k.k3 + t * 9 * k.k4)));
}

/// w1 of the paper: beyond cos psi = -w1 there is no valid image.
double limit_on_second_sphere(const DoubleSphere& camera) {
  const double alpha = camera.alpha;
  return alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
}

}  // namespace

double radius(const KannalaBrandt& camera, double theta) {
  const double t = theta * theta;
  return theta * (1 + t * (camera.k1 + t * (camera.k2 + t * (camera.k3 + t * camera.k4))));
}

double largest_theta(const KannalaBrandt& camera) {
  constexpr int steps = 2000;  // the slope has at most four zeros
  for (int i = 1; i <= steps; ++i) {
    const double theta = pi * i / steps;
    if (kannala_brandt_slope(camera, theta) <= 0) {
      return bisect([&](double t) { return -kannala_brandt_slope(camera, t); }, pi * (i - 1) / steps, theta);
    }
  }
  return pi;
}

std::optional<V2> project(const KannalaBrandt& camera, const V3& point_cv) {
  if (!finite_and_not_zero(point_cv)) return std::nullopt;
  const double theta = theta_of(point_cv);
  // The point exactly behind the camera has no azimuth and so no unique pixel.
  if (theta > largest_theta(camera) || theta == pi) return std::nullopt;
  return pixel_at(camera, point_cv, radius(camera, theta));
}

std::optional<V3> unproject(const KannalaBrandt& camera, const V2& pixel) {
  return unproject_radially(camera, pixel, largest_theta(camera));
}

double radius(const DoubleSphere& camera, double theta) {
  const double shifted = camera.xi + std::cos(theta);
  const double d2 = std::hypot(std::sin(theta), shifted);
  const double denominator = camera.alpha * d2 + (1 - camera.alpha) * shifted;
  if (!(denominator > 0)) return std::numeric_limits<double>::infinity();
  return std::sin(theta) / denominator;
}

double largest_theta(const DoubleSphere& camera) {
  const double w1 = limit_on_second_sphere(camera);
  const double w2 = (w1 + camera.xi) / std::sqrt(2 * w1 * camera.xi + camera.xi * camera.xi + 1);
  return std::acos(std::clamp(-w2, -1.0, 1.0));
}

double turning_theta(const DoubleSphere& camera) {
  const double w1 = limit_on_second_sphere(camera);
  const double xi = camera.xi;
  const double rest = 1 - w1 * w1;
  const double cosine = -xi * rest - w1 * std::sqrt(1 - xi * xi * rest);
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

std::optional<V2> project(const DoubleSphere& camera, const V3& point_cv) {
  if (!finite_and_not_zero(point_cv)) return std::nullopt;
  const double theta = theta_of(point_cv);
  if (!(theta < largest_theta(camera))) return std::nullopt;
  const double r = radius(camera, theta);
  if (!std::isfinite(r)) return std::nullopt;
  return pixel_at(camera, point_cv, r);
}

std::optional<V3> unproject(const DoubleSphere& camera, const V2& pixel) {
  return unproject_radially(camera, pixel, turning_theta(camera));
}

std::optional<V2> project(const Equirectangular& camera, const V3& point_cv) {
  if (!finite_and_not_zero(point_cv)) return std::nullopt;
  const double longitude = std::atan2(point_cv.x, point_cv.z);
  const double latitude = std::atan2(-point_cv.y, std::hypot(point_cv.x, point_cv.z));
  return V2{camera.width * (longitude / (2 * pi) + 0.5) - 0.5, camera.height * (0.5 - latitude / pi) - 0.5};
}

std::optional<V3> unproject(const Equirectangular& camera, const V2& pixel) {
  const double u = (pixel.x + 0.5) / camera.width;
  const double v = (pixel.y + 0.5) / camera.height;
  if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1)) return std::nullopt;
  const double longitude = 2 * pi * (u - 0.5);
  const double latitude = pi * (0.5 - v);
  return V3{std::cos(latitude) * std::sin(longitude), -std::sin(latitude), std::cos(latitude) * std::cos(longitude)};
}

}  // namespace lightwell::reference
