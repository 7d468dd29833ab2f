#include "core/coverage_grid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lightwell::core {
namespace {

/// Projection onto the plane from one point of light, into cells.
class Projection {
 public:
  Projection(LightPoint point, float scale)
      : point_(point), scale_(scale), shear_x_(point.x / point.z), shear_y_(point.y / point.z) {}

  [[nodiscard]] Cell operator()(Vec3f p) const {
    if (point_.w == 0) return {scale_ * (p.x - shear_x_ * p.z), scale_ * (p.y - shear_y_ * p.z)};
    // p + (p - point) z / (z_point - z)
    const float k = p.z / (point_.z - p.z);
    return {scale_ * (p.x + (p.x - point_.x) * k), scale_ * (p.y + (p.y - point_.y) * k)};
  }

 private:
  LightPoint point_;
  float scale_;
  float shear_x_, shear_y_;
};

/// Adds the area below a piece of an edge within one column to the cells from its first row down. `column`: the first
/// row's cell of that column.
inline void add_in_column(float* column, std::size_t stride, float width, float low, float high) {
  // Of that area, 1 - m is in the piece's own row, where m is its mean depth below the row's upper side, and the whole
  // width in the rows that follow.
  const int first = static_cast<int>(low);
  const auto upper = static_cast<float>(first);
  float* cell = column + static_cast<std::size_t>(first) * stride;
  if (high <= upper + 1) {
    const float m = width * (0.5F * (low + high) - upper);
    cell[0] += width - m;
    cell[stride] += m;
    return;
  }
  const float width_per_row = width / (high - low);
  for (float begin = low, row = upper; begin < high; cell += stride) {
    const float end = std::min(high, row + 1), part = width_per_row * (end - begin);
    const float m = part * (0.5F * (begin + end) - row);
    cell[0] += part - m;
    cell[stride] += m;
    begin = row = row + 1;
  }
}

}  // namespace

void CoverageGrid::reset(int columns, int rows, float scale, std::size_t planes) {
  columns_ = columns;
  rows_ = rows;
  scale_ = scale;
  for (Layer& layer : layers_) layer.assign(stride() * static_cast<std::size_t>(rows + 2), 0.0F);
  for (std::vector<float>* v : {&running_, &covered_}) v->assign(kLayers * stride(), 0.0F);
  row_columns_.assign(static_cast<std::size_t>(rows + 3), Range{});
  if (planes_.size() != planes) planes_.resize(planes);
  clear();
}

void CoverageGrid::clear() {
  for (std::vector<float>& plane : planes_) plane.assign(stride() * static_cast<std::size_t>(rows_), 0.0F);
}

void CoverageGrid::add(const Occluder& occluder, std::span<const SilhouetteEdge> silhouettes, LightPoint point,
                       unsigned bit, std::span<const float> weights) {
  rows_touched_ = {};
  cut_off_left_ = cut_off_right_ = false;
  const Projection project(point, scale_);
  const std::size_t layers = occluder.closed() ? 1 : 2;
  for (const SilhouetteEdge& edge : silhouettes) {
    if ((edge.changes >> bit & 1) == 0) continue;
    const bool facing = (edge.facing >> bit & 1) != 0;
    const Segment& s = occluder.segment(edge);
    const Cell from = project(s.a), to = project(s.b);
    // The outline of the triangles that face the light runs along the edge if the left one does. The others are seen
    // from behind and their outline runs the other way, so that a common edge is the same part of both outlines.
    if (!edge.border || facing) add_edge(layers_[0], from, to, facing ? 1.0F : -1.0F);
    if (edge.border && layers == 2) add_edge(layers_[1], from, to, -1);
  }
  resolve(layers, weights);
}

void CoverageGrid::add_edge(Layer& layer, Cell from, Cell to, float sign) {
  if (from.x > to.x) {
    std::swap(from, to);
    sign = -sign;
  }
  const auto right = static_cast<float>(columns_), below = static_cast<float>(rows_);
  // Projections overflow where texels are extremely long, or a light extremely far to the side.
  for (const float v : {from.x, from.y, to.x, to.y})
    if (!std::isfinite(v)) return;
  // A vertical edge covers nothing, but its rows have to be known.
  if (to.x < 0 || from.x > right) return;
  if (from.x >= 0 && to.x <= right && std::min(from.y, to.y) >= 0 && std::max(from.y, to.y) <= below)
    return add_inside(layer, from.x, from.y, to.x, to.y, sign);
  clip_edge(layer, {from.x, from.y, 0}, {to.x, to.y, 0}, sign);
}

void CoverageGrid::clip_edge(Layer& layer, Vec3d from, Vec3d to, float sign) {
  const double slope = (to.y - from.y) / (to.x - from.x);
  cut_off_left_ = cut_off_left_ || from.x < 0;
  cut_off_right_ = cut_off_right_ || to.x > columns_;
  if (from.x < 0) from = {0, from.y - from.x * slope, 0};
  if (to.x > columns_) to = {static_cast<double>(columns_), from.y + (columns_ - from.x) * slope, 0};
  // Cells below the last row are not of interest. Above the first row an edge counts as if it were on its upper side.
  const double bottom = rows_;
  if (from.y >= bottom && to.y >= bottom) return;
  const auto cut = [&](double height) { return std::clamp(from.x + (height - from.y) / slope, from.x, to.x); };
  const auto inside = [&](double x0, double y0, double x1, double y1) {
    if (x1 >= x0)
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
  const int last = columns_ - 1, first_column = std::min(static_cast<int>(x0), last);
  const float low = std::min(y0, y1), high = std::max(y0, y1);
  const Range columns{first_column, std::min(static_cast<int>(x1), last)};
  const int first_row = static_cast<int>(low), last_row = static_cast<int>(high);
  // The piece in a row also changes the row below.
  for (int row = first_row; row <= last_row + 1; ++row) row_columns_[static_cast<std::size_t>(row)].include(columns);
  rows_touched_.include({first_row, last_row + 1});
  float* const cells = layer.data();
  const std::size_t stride = this->stride();
  if (columns.first == columns.last) return add_in_column(cells + first_column, stride, sign * (x1 - x0), low, high);
  const float slope = (y1 - y0) / (x1 - x0);
  float x = x0, y = y0;
  for (int column = first_column; column <= columns.last; ++column) {
    const float border = column == columns.last ? x1 : static_cast<float>(column + 1);
    const float next = column == columns.last ? y1 : std::clamp(y0 + (border - x0) * slope, low, high);
    add_in_column(cells + column, stride, sign * (border - x), std::min(y, next), std::max(y, next));
    x = border;
    y = next;
  }
}

void CoverageGrid::resolve(std::size_t layers, std::span<const float> weights) {
  // In a row, covered cells lie between the edges that cross it, or between these and a side of the grid beyond which
  // edges were cut off; from side to side where no edge crosses it. The last two rows are below the grid.
  const int last_row = cut_off_left_ && cut_off_right_ ? rows_ + 1 : rows_touched_.last;
  std::ranges::fill(running_, 0.0F);
  for (int row = rows_touched_.first; row <= last_row; ++row) {
    Range& touched = row_columns_[static_cast<std::size_t>(row)];
    const Range columns{cut_off_left_ ? 0 : touched.first, cut_off_right_ ? columns_ - 1 : touched.last};
    touched = {};
    if (columns.last < columns.first) continue;
    const auto count = static_cast<std::size_t>(columns.last - columns.first + 1);
    const std::size_t at = static_cast<std::size_t>(row) * stride() + static_cast<std::size_t>(columns.first);
    float* const covered = covered_.data();
    float* const facing = running_.data() + columns.first;
    float* const cells = layers_[0].data() + at;
    for (std::size_t x = 0; x < count; ++x) {
      const float sum = facing[x] + cells[x];
      facing[x] = sum;
      cells[x] = 0;
      covered[x] = std::min(1.0F, std::max(0.0F, sum));
    }
    if (layers == 2) {
      float* const others = running_.data() + stride() + columns.first;
      float* const more = layers_[1].data() + at;
      for (std::size_t x = 0; x < count; ++x) {
        const float sum = others[x] + more[x];
        others[x] = sum;
        more[x] = 0;
        covered[x] = std::max(covered[x], std::min(1.0F, facing[x] + sum));
      }
    }
    if (row >= rows_) continue;
    for (std::size_t p = 0; p < weights.size(); ++p) {
      float* const plane = planes_[p].data() + at;
      const float weight = weights[p];
      for (std::size_t x = 0; x < count; ++x) plane[x] += weight * covered[x];
    }
  }
}

}  // namespace lightwell::core
