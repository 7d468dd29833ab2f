#include "image_object/light_arrangement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace lightwell::image_object {
namespace {

/// Squared distance of directions that are taken as equal.
constexpr double kEqual2 = 1e-12;

double distance2(Vec3d a, Vec3d b) { return dot(a - b, a - b); }

/// The nearest lights, no two with the same direction, nearest first.
struct Neighbours {
  std::array<std::size_t, kMaxNeighbours> light{};
  std::array<Vec3d, kMaxNeighbours> direction{};
  std::array<double, kMaxNeighbours> distance2{};
  std::size_t count = 0;
};

Neighbours find_neighbours(std::span<const Vec3f> directions, Vec3d towards) {
  Neighbours out;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Vec3d d = vec_cast<double>(directions[i]);
    const double far = distance2(d, towards);
    if (out.count == kMaxNeighbours && far >= out.distance2[out.count - 1]) continue;
    bool twin = false;
    for (std::size_t k = 0; k < out.count; ++k) twin |= distance2(out.direction[k], d) < kEqual2;
    if (twin) continue;
    std::size_t at = out.count < kMaxNeighbours ? out.count++ : kMaxNeighbours - 1;
    for (; at > 0 && out.distance2[at - 1] > far; --at) {
      out.light[at] = out.light[at - 1];
      out.direction[at] = out.direction[at - 1];
      out.distance2[at] = out.distance2[at - 1];
    }
    out.light[at] = i;
    out.direction[at] = d;
    out.distance2[at] = far;
  }
  return out;
}

Vec3d closest_on_edge(Vec3d a, Vec3d b, Vec3d p) {
  const Vec3d ab = b - a;
  return a + ab * std::clamp(dot(p - a, ab) / dot(ab, ab), 0.0, 1.0);
}

/// Whether the foot of p on the plane of a triangle is inside it; sets `foot`.
bool foot_inside(Vec3d a, Vec3d b, Vec3d c, Vec3d p, Vec3d& foot) {
  const Vec3d ab = b - a, ac = c - a, normal = cross(ab, ac);
  const double area2 = dot(normal, normal);
  if (area2 < kEqual2 * kEqual2) return false;
  const double v = dot(cross(p - a, ac), normal) / area2, w = dot(cross(ab, p - a), normal) / area2;
  if (v < 0 || w < 0 || v + w > 1) return false;
  foot = a + ab * v + ac * w;
  return true;
}

/// The direction nearest to `towards` on edges and triangles of the neighbours.
Vec3d project(const Neighbours& near, Vec3d towards) {
  Vec3d best = near.direction[0];
  double best2 = distance2(best, towards);
  const auto consider = [&](Vec3d p) {
    const double d2 = distance2(p, towards);
    if (d2 < best2) {
      best2 = d2;
      best = p;
    }
  };
  for (std::size_t i = 0; i < near.count; ++i)
    for (std::size_t j = i + 1; j < near.count; ++j) {
      consider(closest_on_edge(near.direction[i], near.direction[j], towards));
      Vec3d foot;
      for (std::size_t k = j + 1; k < near.count; ++k)
        if (foot_inside(near.direction[i], near.direction[j], near.direction[k], towards, foot)) consider(foot);
    }
  const Vec3d direction = normalized(best);
  return dot(direction, direction) > 0 ? direction : near.direction[0];
}

constexpr std::size_t kSystem = kMaxNeighbours + 1;
using System = std::array<std::array<double, kSystem>, kSystem>;

/// Gaussian elimination with column pivots. False if the system is singular.
bool solve(System& a, std::array<double, kSystem>& b, std::size_t n) {
  for (std::size_t column = 0; column < n; ++column) {
    std::size_t pivot = column;
    for (std::size_t row = column + 1; row < n; ++row)
      if (std::abs(a[row][column]) > std::abs(a[pivot][column])) pivot = row;
    if (!(std::abs(a[pivot][column]) > 1e-14)) return false;
    std::swap(a[pivot], a[column]);
    std::swap(b[pivot], b[column]);
    for (std::size_t row = column + 1; row < n; ++row) {
      const double factor = a[row][column] / a[column][column];
      for (std::size_t k = column; k < n; ++k) a[row][k] -= factor * a[column][k];
      b[row] -= factor * b[column];
    }
  }
  for (std::size_t column = n; column-- > 0;) {
    for (std::size_t k = column + 1; k < n; ++k) b[column] -= a[column][k] * b[k];
    b[column] /= a[column][column];
  }
  return true;
}

}  // namespace

LightWeights nearest_light(std::span<const Vec3f> directions, Vec3d towards) {
  LightWeights out;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const double d2 = distance2(vec_cast<double>(directions[i]), towards);
    if (d2 >= best) continue;
    best = d2;
    out.entries[0] = {i, 1};
  }
  out.count = 1;
  out.outside_rad = angle_between(vec_cast<double>(directions[out.entries[0].light]), towards);
  return out;
}

LightWeights smooth_lights(std::span<const Vec3f> directions, Vec3d towards) {
  const Neighbours near = find_neighbours(directions, towards);
  LightWeights out = nearest_light(directions, towards);
  if (near.count < 2) return out;
  const Vec3d inside = project(near, towards);
  // The shape parameter: twice the distance of the nearest two lights. On an arc the weights are then nearly those of a
  // cubic polynomial.
  const double shape2 = 4 * distance2(near.direction[0], near.direction[1]);
  const auto kernel = [&](Vec3d a, Vec3d b) { return std::sqrt(distance2(a, b) + shape2) / std::sqrt(shape2); };
  System a{};
  std::array<double, kSystem> b{};
  const std::size_t n = near.count;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) a[i][j] = kernel(near.direction[i], near.direction[j]);
    a[i][n] = a[n][i] = 1;
    b[i] = kernel(near.direction[i], inside);
  }
  b[n] = 1;
  if (!solve(a, b, n + 1)) return out;
  out.count = n;
  for (std::size_t i = 0; i < n; ++i) out.entries[i] = {near.light[i], b[i]};
  return out;
}

}  // namespace lightwell::image_object
