#include "core/coverage_grid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lightwell::core {
namespace {

/// Projection of p from the point onto the plane, in texels.
Vec3d projected(Vec3f p, LightPoint point) {
  const double k = 1.0 / (static_cast<double>(point.z) - static_cast<double>(point.w) * static_cast<double>(p.z));
  const auto along = [&](float of_p, float of_point) {
    return (static_cast<double>(of_p) * static_cast<double>(point.z) -
            static_cast<double>(of_point) * static_cast<double>(p.z)) *
           k;
  };
  return {along(p.x, point.x), along(p.y, point.y), 0};
}

}  // namespace

void CoverageGrid::reset(int columns, int rows, float scale, std::size_t planes) {
  columns_ = columns;
  rows_ = rows;
  scale_ = scale;
  for (Layer& layer : layers_) layer.assign(stride() * static_cast<std::size_t>(rows + 2), 0.0F);
  for (std::vector<float>* v : {&running_, &covered_}) v->assign(kLayers * stride(), 0.0F);
  if (planes_.size() != planes) planes_.resize(planes);
  clear();
}

void CoverageGrid::clear() {
  for (std::vector<float>& plane : planes_) plane.assign(stride() * static_cast<std::size_t>(rows_), 0.0F);
}

void CoverageGrid::add(const Occluder& occluder, std::span<const SilhouetteEdge> silhouettes, LightPoint point,
                       unsigned bit, std::span<const float> weights) {
  first_row_ = rows_;
  first_column_ = columns_;
  last_row_ = last_column_ = -1;
  const auto scale = static_cast<double>(scale_);
  const std::size_t layers = occluder.closed() ? 1 : 2;
  for (const SilhouetteEdge& edge : silhouettes) {
    if ((edge.changes >> bit & 1) == 0) continue;
    const bool facing = (edge.facing >> bit & 1) != 0;
    const Segment& s = occluder.segment(edge);
    const Vec3d from = projected(s.a, point) * scale, to = projected(s.b, point) * scale;
    // The outline of the triangles that face the light runs along the edge if the left one does. The others are seen
    // from behind: their outline runs the other way, which at a common edge is the same direction.
    const float sign = facing ? 1.0F : -1.0F;
    if (!edge.border || facing) add_edge(layers_[0], from, to, sign);
    if (layers == 2 && (!edge.border || !facing)) add_edge(layers_[1], from, to, sign);
  }
  resolve(layers, weights);
}

void CoverageGrid::add_edge(Layer& layer, Vec3d from, Vec3d to, float sign) {
  if (from.x > to.x) {
    std::swap(from, to);
    sign = -sign;
  }
  // Both are false for NaN.
  if (!(to.x > 0 && from.x < columns_) || !(to.x > from.x)) return;
  const double slope = (to.y - from.y) / (to.x - from.x);
  if (from.x < 0) from = {0, from.y - from.x * slope, 0};
  if (to.x > columns_) to = {static_cast<double>(columns_), from.y + (columns_ - from.x) * slope, 0};
  // Cells below the last row are not of interest. Above the first row an edge counts as if it were on its upper side.
  const double bottom = rows_;
  if (std::max(from.y, to.y) > bottom) last_row_ = rows_ - 1;
  if (from.y >= bottom && to.y >= bottom) return;
  const auto cut = [&](double height) { return std::clamp(from.x + (height - from.y) / slope, from.x, to.x); };
  const auto inside = [&](double x0, double y0, double x1, double y1) {
    if (x1 > x0)
      add_inside(layer, static_cast<float>(x0), static_cast<float>(y0), static_cast<float>(x1), static_cast<float>(y1),
                 sign);
  };
  if (from.y > bottom) from = {cut(bottom), bottom, 0};
  if (to.y > bottom) to = {cut(bottom), bottom, 0};
  if (from.y <= 0 && to.y <= 0) return inside(from.x, 0, to.x, 0);
  if (from.y < 0) {
    const double x = cut(0);
    inside(from.x, 0, x, 0);
    from = {x, 0, 0};
  } else if (to.y < 0) {
    const double x = cut(0);
    inside(x, 0, to.x, 0);
    to = {x, 0, 0};
  }
  inside(from.x, from.y, to.x, to.y);
}

void CoverageGrid::add_inside(Layer& layer, float x0, float y0, float x1, float y1, float sign) {
  const int last = columns_ - 1;
  int column = std::min(static_cast<int>(x0), last);
  first_column_ = std::min(first_column_, column);
  first_row_ = std::min(first_row_, static_cast<int>(std::min(y0, y1)));
  last_row_ = std::max(last_row_, std::min(static_cast<int>(std::max(y0, y1)), rows_ - 1));
  const float slope = (y1 - y0) / (x1 - x0), low = std::min(y0, y1), high = std::max(y0, y1);
  float x = x0, y = y0;
  for (; column < last; ++column) {
    const auto border = static_cast<float>(column + 1);
    if (border >= x1) break;
    const float next = std::clamp(y0 + (border - x0) * slope, low, high);
    add_in_column(layer, column, border - x, std::min(y, next), std::max(y, next), sign);
    x = border;
    y = next;
  }
  add_in_column(layer, column, x1 - x, std::min(y, y1), std::max(y, y1), sign);
  last_column_ = std::max(last_column_, column);
}

void CoverageGrid::add_in_column(Layer& layer, int column, float width, float low, float high, float sign) {
  // Of the area under a piece of the edge, 1 - m is in the piece's own row, where m is its mean depth below the row's
  // upper side, and the whole width in the rows that follow.
  const int first = static_cast<int>(low), last = static_cast<int>(high);
  float* cell = layer.data() + static_cast<std::size_t>(first) * stride() + column;
  if (first == last) {
    const float m = 0.5F * (low + high) - static_cast<float>(first);
    cell[0] += sign * width * (1 - m);
    cell[stride()] += sign * width * m;
    return;
  }
  const float width_per_row = width / (high - low);
  for (int row = first; row <= last; ++row, cell += stride()) {
    const float begin = std::max(low, static_cast<float>(row)), end = std::min(high, static_cast<float>(row + 1));
    const float part = sign * width_per_row * (end - begin), m = 0.5F * (begin + end) - static_cast<float>(row);
    cell[0] += part * (1 - m);
    cell[stride()] += part * m;
  }
}

void CoverageGrid::resolve(std::size_t layers, std::span<const float> weights) {
  if (last_column_ < first_column_) return;
  const auto begin = static_cast<std::size_t>(first_column_);
  const auto count = static_cast<std::size_t>(last_column_ - first_column_ + 1);
  std::ranges::fill(running_, 0.0F);
  // One row more, and the one below, hold what the last row's edges leave there.
  for (int row = first_row_; row <= last_row_; ++row) {
    const std::size_t at = static_cast<std::size_t>(row) * stride() + begin;
    float* const covered = covered_.data();
    for (std::size_t k = 0; k < layers; ++k) {
      float* const cells = layers_[k].data() + at;
      float* const running = running_.data() + k * stride();
      if (k == 0) {
        for (std::size_t x = 0; x < count; ++x) {
          running[x] += cells[x];
          cells[x] = 0;
          covered[x] = std::min(std::max(running[x], 0.0F), 1.0F);
        }
      } else {
        for (std::size_t x = 0; x < count; ++x) {
          running[x] += cells[x];
          cells[x] = 0;
          covered[x] = std::max(covered[x], std::min(running[x], 1.0F));
        }
      }
    }
    for (std::size_t p = 0; p < weights.size(); ++p) {
      float* const plane = planes_[p].data() + at;
      const float weight = weights[p];
      for (std::size_t x = 0; x < count; ++x) plane[x] += weight * covered[x];
    }
  }
  for (std::size_t k = 0; k < layers; ++k)
    for (std::size_t row = static_cast<std::size_t>(last_row_ + 1); row <= static_cast<std::size_t>(last_row_ + 2);
         ++row)
      if (row < static_cast<std::size_t>(rows_ + 2))
        std::fill_n(layers_[k].data() + row * stride() + begin, count, 0.0F);
}

}  // namespace lightwell::core
