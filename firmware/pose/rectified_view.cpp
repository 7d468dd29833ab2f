#include "pose/rectified_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lightwell {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kViewsPerRing = 8;
constexpr double kRingHalf = 40 * kDegree, kMiddleHalf = 45 * kDegree;
/// Largest angle of the first ring's centres from the axis: views further out would exceed the field of view of most
/// lenses. A lens with a larger field has further rings.
constexpr double kRingCenter = 70 * kDegree, kRingStep = 50 * kDegree;
constexpr int kMaxSize_px = 1600;
constexpr std::uint8_t kGrey = 128;
/// The camera model is evaluated at the corners of blocks of this many pixels and interpolated bilinearly between them.
/// The error of some hundredths of a pixel does not matter, because corners are refined in the original picture.
constexpr int kBlock = 8;

Vec3d direction_cv(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

/// Resolution of the lens in a direction, px/rad: the larger of the radial and the tangential one.
std::optional<double> density(const CameraModel& lens, double theta, double phi) {
  const Vec3d ahead = direction_cv(theta, phi);
  const Vec3d radial = direction_cv(theta + std::numbers::pi / 2, phi), around = cross(ahead, radial);
  constexpr double kStep = 1e-3;
  double best = 0;
  for (const Vec3d aside : {radial, around}) {
    const auto a = lens.project(ahead - aside * kStep), b = lens.project(ahead + aside * kStep);
    if (!a || !b) return std::nullopt;
    best = std::max(best, std::hypot(b->x - a->x, b->y - a->y) / (2 * kStep));
  }
  return best > 0 ? std::optional(best) : std::nullopt;
}

std::optional<ViewAxes> view_towards(const CameraModel& lens, double theta, double phi, double half) {
  const auto focal = density(lens, theta, phi);
  if (!focal) return std::nullopt;
  ViewAxes view;
  view.forward = direction_cv(theta, phi);
  // "Down" points away from the axis; any choice will do, because tags are detected in any orientation.
  view.down = direction_cv(theta + std::numbers::pi / 2, phi);
  view.right = cross(view.down, view.forward);
  const double wanted = 2 * *focal * std::tan(half);
  view.size = static_cast<int>(std::clamp(wanted, 16.0, static_cast<double>(kMaxSize_px)));
  view.focal_px = *focal * view.size / wanted;
  return view;
}

/// The largest angle from the axis that the picture shows, rad; the model's limit where its rim lies in the picture.
double largest_angle(const CameraModel& lens, int width, int height) {
  const double end = lens.max_angle_rad();
  constexpr int kSteps = 64;
  double seen = 0;
  const auto include = [&](double x, double y) {
    if (const auto d = lens.unproject({x, y})) seen = std::max(seen, std::atan2(std::hypot(d->x, d->y), d->z));
  };
  for (int i = 0; i <= kSteps; ++i) {
    const double x = (width - 1.0) * i / kSteps, y = (height - 1.0) * i / kSteps;
    include(x, 0), include(x, height - 1.0), include(0, y), include(width - 1.0, y);
  }
  // The rim of the field of view may lie in the picture all around, or in a part of it.
  for (int i = 0; i < kSteps; ++i) {
    const auto p = lens.project(direction_cv(end * (1 - 1e-9), 2 * std::numbers::pi * i / kSteps));
    if (p && p->x >= 0 && p->y >= 0 && p->x <= width - 1 && p->y <= height - 1) return end;
  }
  return seen;
}

std::uint8_t sampled(const GreyPicture& picture, PixelPosition p) {
  const double fx = std::floor(p.x), fy = std::floor(p.y);
  if (!(fx >= 0 && fy >= 0 && fx < picture.width - 1 && fy < picture.height - 1)) return kGrey;
  const int x = static_cast<int>(fx), y = static_cast<int>(fy);
  const double u = p.x - fx, v = p.y - fy;
  const double value = (1 - v) * ((1 - u) * picture.at(x, y) + u * picture.at(x + 1, y)) +
                       v * ((1 - u) * picture.at(x, y + 1) + u * picture.at(x + 1, y + 1));
  return static_cast<std::uint8_t>(value + 0.5);
}

}  // namespace

RectifiedView::RectifiedView(const GreyPicture& picture, const CameraModel& lens, const ViewAxes& axes)
    : axes_(axes), pixels_(static_cast<std::size_t>(axes.size) * static_cast<std::size_t>(axes.size), kGrey) {
  const auto at = [&](int x, int y) { return original(lens, {static_cast<double>(x), static_cast<double>(y)}); };
  for (int top = 0; top < axes.size; top += kBlock)
    for (int left = 0; left < axes.size; left += kBlock) {
      const auto a = at(left, top), b = at(left + kBlock, top), c = at(left, top + kBlock),
                 d = at(left + kBlock, top + kBlock);
      const bool smooth = a && b && c && d;
      for (int y = top; y < std::min(top + kBlock, axes.size); ++y)
        for (int x = left; x < std::min(left + kBlock, axes.size); ++x) {
          std::optional<PixelPosition> p;
          if (smooth) {
            const double u = static_cast<double>(x - left) / kBlock, v = static_cast<double>(y - top) / kBlock;
            const double wa = (1 - u) * (1 - v), wb = u * (1 - v), wc = (1 - u) * v, wd = u * v;
            p = PixelPosition{wa * a->x + wb * b->x + wc * c->x + wd * d->x,
                              wa * a->y + wb * b->y + wc * c->y + wd * d->y};
          } else if (a || b || c || d) {
            p = at(x, y);
          }
          if (p) pixels_[static_cast<std::size_t>(y * axes.size + x)] = sampled(picture, *p);
        }
    }
}

GreyPicture RectifiedView::picture() const {
  return {pixels_, axes_.size, axes_.size, static_cast<std::size_t>(axes_.size)};
}

std::optional<PixelPosition> RectifiedView::original(const CameraModel& lens, PixelPosition in_view) const {
  const double middle = (axes_.size - 1) / 2.0;
  return lens.project(axes_.forward * axes_.focal_px + axes_.right * (in_view.x - middle) +
                      axes_.down * (in_view.y - middle));
}

std::vector<ViewAxes> views_of(const CameraModel& lens, int width, int height, double beyond_rad) {
  std::vector<ViewAxes> views;
  const double end = largest_angle(lens, width, height);
  if (!(end > beyond_rad)) return views;
  if (const auto middle = view_towards(lens, 0, 0, kMiddleHalf)) views.push_back(*middle);
  for (double theta = std::clamp(end - 20 * kDegree, 35 * kDegree, kRingCenter);; theta += kRingStep) {
    for (int i = 0; i < kViewsPerRing; ++i)
      if (const auto view = view_towards(lens, theta, 2 * std::numbers::pi * i / kViewsPerRing, kRingHalf))
        views.push_back(*view);
    if (theta + kRingHalf >= end) break;
  }
  return views;
}

}  // namespace lightwell
