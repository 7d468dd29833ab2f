#include "pose/corner_refiner.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "pose/edge_blur.hpp"
#include "pose/edge_fit.hpp"

namespace lightwell {

namespace {

using Eigen::Vector2d;

/// Length of the edge that is fitted, px; along more, a parabola is no longer a good model.
constexpr double kFitLength_px = 40;
/// Systematic error of the edge model, standard deviation, px.
constexpr double kModelSigma_px = 0.005;

Vector2d vector(PixelPosition p) { return {p.x, p.y}; }

/// The intersection of two edges by Newton's method, from `s0` along the one and `t0` along the other, px.
std::optional<RefinedCorner> intersect(const Edge& a, const Edge& b, double s0 = 0, double t0 = 0) {
  double s = s0, t = t0;
  for (int i = 0; i < 10; ++i) {
    const Vector2d ta = a.along + a.out * a.slope(s), tb = b.along + b.out * b.slope(t);
    Eigen::Matrix2d j;
    j << ta, -tb;
    // The intersection of almost parallel edges is undetermined.
    if (std::abs(j.determinant()) < 0.1) return std::nullopt;
    const Vector2d step = j.inverse() * (b.at(t) - a.at(s));
    s += step.x();
    t += step.y();
    if (!(std::abs(s - s0) < kFitLength_px && std::abs(t - t0) < kFitLength_px)) return std::nullopt;
    if (step.cwiseAbs().maxCoeff() < 1e-9) break;
  }
  const Vector2d p = a.at(s);
  const auto variance = [](const Edge& e, double at) {
    const double u = at / e.end;
    const Eigen::Vector3d row(1, u, u * u);
    return row.dot(e.covariance * row) + kModelSigma_px * kModelSigma_px;
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

/// The edge from `corner` to `end`, at most `reach` px of it. `opposite` is the corner's other neighbour: it lies on
/// the inner side of the edge. nullopt for an edge that is too short or a tag that is too narrow.
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
  e.begin = std::min(kCornerMargin_px / sine, 0.25 * length);
  e.end = std::min(length - e.begin, reach);
  return e;
}

/// False for a corner that moved by more than one and a half cells (at least 3 px): it belongs to something else.
bool is_near_start(const RefinedCorner& corner, Vector2d given, const Edge& a, const Edge& b) {
  return (vector(corner.position) - given).norm() < std::max({3.0, 1.5 * a.cell, 1.5 * b.cell});
}

/// RefinedTag::blur_px, from the blur of each edge.
std::optional<double> blur_of_tag(const std::array<std::optional<double>, 4>& edges) {
  std::optional<double> out;
  for (std::size_t i = 0; i < 2; ++i) {
    double sum = 0;
    int count = 0;
    for (const std::optional<double>& blur : {edges[i], edges[i + 2]})
      if (blur) sum += *blur, ++count;
    if (count > 0) out = std::max(out.value_or(0), sum / count);
  }
  return out;
}

}  // namespace

RefinedTag refine_corners(const GreyPicture& picture, const TagOutline& outline, std::span<const float> linear) {
  RefinedTag out;
  std::array<std::optional<double>, 4> blurs;
  const LinearPicture intensity(picture, linear);
  const double sign = outline.dark_inside ? 1 : -1;
  const auto given = [&](std::size_t i) { return vector(outline.corners[i % 4]); };
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d next = given(i + 1), before = given(i + 3);
    auto a = edge_from(given(i), next, before, outline.edge_cells, kFitLength_px);
    auto b = edge_from(given(i), before, next, outline.edge_cells, kFitLength_px);
    if (!a || !b) continue;
    // A curved edge of a large tag lies far from its chord: trace within a wide band first, then along the result.
    const auto trace = [&](Edge& e, double max_reach) {
      return trace_edge(intensity, e, std::clamp(0.6 * e.cell, 1.0, max_reach), sign);
    };
    if (!trace(*a, 20) || !trace(*b, 20)) continue;
    const auto rough = intersect(*a, *b);
    if (!rough) continue;
    const auto realign = [&](Edge& e) {
      const Vector2d tangent = e.tangent(0);
      const Vector2d out_before = e.out;
      e.origin = vector(rough->position);
      e.along = tangent;
      e.out = Vector2d(-tangent.y(), tangent.x());
      if (e.out.dot(out_before) < 0) e.out = -e.out;
      e.curve.setZero();
    };
    realign(*a);
    realign(*b);
    if (!trace(*a, 3) || !trace(*b, 3) || !fit(intensity, *a, sign) || !fit(intensity, *b, sign)) continue;
    blurs[i] = measure_blur(intensity, *a, sign);
    const auto corner = intersect(*a, *b);
    if (corner && is_near_start(*corner, given(i), *a, *b)) out.corners[i] = corner;
  }
  out.blur_px = blur_of_tag(blurs);
  return out;
}

RefinedTag locate_corners_by_edge_search(const GreyPicture& picture, const TagOutline& outline,
                                         std::span<const float> linear, double reach) {
  RefinedTag out;
  const LinearPicture intensity(picture, linear);
  const double sign = outline.dark_inside ? 1 : -1;
  const auto given = [&](std::size_t i) { return vector(outline.corners[i % 4]); };
  std::array<std::optional<Edge>, 4> edges;  // From corner i to i + 1.
  std::array<std::optional<double>, 4> blurs;
  for (std::size_t i = 0; i < 4; ++i) {
    const double length = (given(i + 1) - given(i)).norm();
    edges[i] = edge_from(given(i), given(i + 1), given(i + 3), outline.edge_cells, length);
    if (edges[i] && !trace_edge(intensity, *edges[i], std::clamp(0.6 * edges[i]->cell, 1.0, reach), sign))
      edges[i].reset();
    if (edges[i]) blurs[i] = measure_blur(intensity, *edges[i], sign);
  }
  out.blur_px = blur_of_tag(blurs);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto &before = edges[(i + 3) % 4], &after = edges[i];
    if (!before || !after) continue;
    const auto corner = intersect(*before, *after, (given(i) - given(i + 3)).norm(), 0);
    if (corner && is_near_start(*corner, given(i), *before, *after)) out.corners[i] = corner;
  }
  return out;
}

}  // namespace lightwell
