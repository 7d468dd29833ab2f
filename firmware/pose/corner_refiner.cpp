#include "pose/corner_refiner.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "pose/edge_fit.hpp"

namespace lightwell {

namespace {

using Eigen::Vector2d;

/// How much of an edge counts, px: more would only be a longer way for the parabola to go wrong.
constexpr double kReach = 40;
/// Blur rounds a corner; so far from both edges it is gone for a sigma of 1 px.
constexpr double kMargin = 2.5;
/// What no model of an edge is better than, px.
constexpr double kFloor = 0.005;

/// Where two edges meet, near `s0` of the one and `t0` of the other.
std::optional<RefinedCorner> meeting(const Edge& a, const Edge& b, double s0 = 0, double t0 = 0) {
  double s = s0, t = t0;
  for (int i = 0; i < 10; ++i) {
    const Vector2d ta = a.along + a.out * a.slope(s), tb = b.along + b.out * b.slope(t);
    Eigen::Matrix2d j;
    j << ta, -tb;
    // Edges that are almost one line meet anywhere.
    if (std::abs(j.determinant()) < 0.1) return std::nullopt;
    const Vector2d step = j.inverse() * (b.at(t) - a.at(s));
    s += step.x();
    t += step.y();
    if (!(std::abs(s - s0) < kReach && std::abs(t - t0) < kReach)) return std::nullopt;
    if (step.cwiseAbs().maxCoeff() < 1e-9) break;
  }
  const Vector2d p = a.at(s);
  const auto variance = [](const Edge& e, double at) {
    const double u = at / e.end;
    const Eigen::Vector3d row(1, u, u * u);
    return row.dot(e.covariance * row) + kFloor * kFloor;
  };
  const auto normal = [](const Edge& e, double at) {
    const Vector2d tangent = e.tangent(at);
    return Eigen::RowVector2d(-tangent.y(), tangent.x());
  };
  Eigen::Matrix2d normals;
  normals << normal(a, s), normal(b, t);
  const Eigen::Matrix2d back = normals.inverse();
  const Eigen::Matrix2d c = back * Eigen::Vector2d(variance(a, s), variance(b, t)).asDiagonal() * back.transpose();
  return RefinedCorner{{p.x(), p.y()}, {c(0, 0), c(0, 1), c(1, 1)}};
}

/// The edge from `corner` to `end` of a tag whose opposite side `opposite` tells where its inside is, as far as
/// `reach`.
std::optional<Edge> edge_from(Vector2d corner, Vector2d end, Vector2d opposite, int edge_cells, double reach) {
  Edge e;
  const double length = (end - corner).norm();
  const Vector2d aside = opposite - corner;
  if (!(length > 6)) return std::nullopt;
  e.origin = corner;
  e.along = (end - corner) / length;
  e.out = Vector2d(-e.along.y(), e.along.x());
  if (e.out.dot(aside) > 0) e.out = -e.out;
  const double depth = std::abs(e.out.dot(aside)), sine = depth / std::max(aside.norm(), 1e-9);
  if (!(depth > 4) || sine < 0.15) return std::nullopt;
  e.cell = depth / edge_cells;
  e.begin = std::min(kMargin / sine, 0.25 * length);
  e.end = std::min(length - e.begin, reach);
  return e;
}

/// One that wandered off by more than a cell belongs to something else.
bool is_near_start(const RefinedCorner& corner, Vector2d given, const Edge& a, const Edge& b) {
  return (Vector2d(corner.at.x, corner.at.y) - given).norm() < std::max({3.0, 1.5 * a.cell, 1.5 * b.cell});
}

}  // namespace

std::array<std::optional<RefinedCorner>, 4> refine_corners(const GreyPicture& picture, const TagOutline& outline,
                                                           std::span<const float> linear) {
  std::array<std::optional<RefinedCorner>, 4> out;
  const LinearPicture light(picture, linear);
  const double sign = outline.dark_inside ? 1 : -1;
  const auto given = [&](std::size_t i) {
    const PixelPosition p = outline.corners[i % 4];
    return Vector2d(p.x, p.y);
  };
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d next = given(i + 1), before = given(i + 3);
    auto a = edge_from(given(i), next, before, outline.edge_cells, kReach);
    auto b = edge_from(given(i), before, next, outline.edge_cells, kReach);
    if (!a || !b) continue;
    // A bent edge of a large tag lies far from the chord: first a wide look, then one along what was found.
    const auto look = [&](Edge& e, double most) { return trace_edge(light, e, std::clamp(0.6 * e.cell, 1.0, most), sign); };
    if (!look(*a, 20) || !look(*b, 20)) continue;
    const auto rough = meeting(*a, *b);
    if (!rough) continue;
    const auto moved = [&](Edge& e) {
      const Vector2d tangent = e.tangent(0);
      const Vector2d out_before = e.out;
      e.origin = Vector2d(rough->at.x, rough->at.y);
      e.along = tangent;
      e.out = Vector2d(-tangent.y(), tangent.x());
      if (e.out.dot(out_before) < 0) e.out = -e.out;
      e.curve.setZero();
    };
    moved(*a);
    moved(*b);
    if (!look(*a, 3) || !look(*b, 3) || !fit(light, *a, sign) || !fit(light, *b, sign)) continue;
    const auto corner = meeting(*a, *b);
    if (corner && is_near_start(*corner, given(i), *a, *b)) out[i] = corner;
  }
  return out;
}

std::array<std::optional<RefinedCorner>, 4> locate_corners_by_edge_search(const GreyPicture& picture, const TagOutline& outline,
                                                           std::span<const float> linear, double reach) {
  std::array<std::optional<RefinedCorner>, 4> out;
  const LinearPicture light(picture, linear);
  const double sign = outline.dark_inside ? 1 : -1;
  const auto given = [&](std::size_t i) {
    const PixelPosition p = outline.corners[i % 4];
    return Vector2d(p.x, p.y);
  };
  std::array<std::optional<Edge>, 4> edges;  // From corner i to i + 1.
  for (std::size_t i = 0; i < 4; ++i) {
    const double length = (given(i + 1) - given(i)).norm();
    edges[i] = edge_from(given(i), given(i + 1), given(i + 3), outline.edge_cells, length);
    if (edges[i] && !trace_edge(light, *edges[i], std::clamp(0.6 * edges[i]->cell, 1.0, reach), sign)) edges[i].reset();
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const auto &before = edges[(i + 3) % 4], &after = edges[i];
    if (!before || !after) continue;
    const auto corner = meeting(*before, *after, (given(i) - given(i + 3)).norm(), 0);
    if (corner && is_near_start(*corner, given(i), *before, *after)) out[i] = corner;
  }
  return out;
}

}  // namespace lightwell
