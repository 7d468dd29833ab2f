#include "measure/shadow_outline.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <lightwell/quantile.hpp>

namespace lightwell::measure {
namespace {

double distance_to(const Segment& s, Point2 p) {
  const double dx = s.to.x - s.from.x, dy = s.to.y - s.from.y, length2 = dx * dx + dy * dy;
  const double along = length2 > 0 ? ((p.x - s.from.x) * dx + (p.y - s.from.y) * dy) / length2 : 0;
  const double t = std::clamp(along, 0.0, 1.0);
  return std::hypot(p.x - s.from.x - t * dx, p.y - s.from.y - t * dy);
}

void add_distances(std::span<const Segment> from, std::span<const Segment> to, std::vector<double>& out) {
  for (const Segment& s : from) {
    const Point2 middle{(s.from.x + s.to.x) / 2, (s.from.y + s.to.y) / 2};
    double nearest = std::numeric_limits<double>::infinity();
    for (const Segment& other : to) nearest = std::min(nearest, distance_to(other, middle));
    out.push_back(nearest);
  }
}

}  // namespace

GreyPicture box_means(const GreyPicture& picture, int half) {
  GreyPicture out(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      double sum = 0;
      int count = 0;
      for (int b = std::max(0, y - half); b <= std::min(picture.height - 1, y + half); ++b)
        for (int a = std::max(0, x - half); a <= std::min(picture.width - 1, x + half); ++a)
          if (const double v = picture.at(a, b); !std::isnan(v)) sum += v, ++count;
      out.at(x, y) = std::isnan(picture.at(x, y)) ? picture.at(x, y) : sum / count;
    }
  return out;
}

std::vector<Segment> contour(const GreyPicture& picture, double level) {
  std::vector<Segment> out;
  for (int y = 0; y + 1 < picture.height; ++y)
    for (int x = 0; x + 1 < picture.width; ++x) {
      // Corners around the cell, and where the level crosses the edge after each.
      const std::array<Point2, 4> at = {{{0. + x, 0. + y}, {1. + x, 0. + y}, {1. + x, 1. + y}, {0. + x, 1. + y}}};
      const std::array<double, 4> v = {picture.at(x, y), picture.at(x + 1, y), picture.at(x + 1, y + 1),
                                       picture.at(x, y + 1)};
      std::array<Point2, 4> crossings;
      std::size_t count = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t next = (k + 1) % 4;
        if (std::isnan(v[k])) count = 5;
        if (count > 4 || (v[k] < level) == (v[next] < level)) continue;
        const double f = (level - v[k]) / (v[next] - v[k]);
        crossings[count++] = {at[k].x + f * (at[next].x - at[k].x), at[k].y + f * (at[next].y - at[k].y)};
      }
      // Of a saddle either pairing will do.
      if (count == 2 || count == 4)
        for (std::size_t k = 0; k < count; k += 2) out.push_back({crossings[k], crossings[k + 1]});
    }
  return out;
}

OutlineDistance outline_distance(std::span<const Segment> a, std::span<const Segment> b) {
  if (a.empty() || b.empty()) return {};
  std::vector<double> distances;
  add_distances(a, b, distances);
  add_distances(b, a, distances);
  return {lower_quantile(distances, 0.5), lower_quantile(distances, 0.95)};
}

}  // namespace lightwell::measure
