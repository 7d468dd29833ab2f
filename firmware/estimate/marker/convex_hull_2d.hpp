// The convex outline of points in a plane, and how far another point is from it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace lightwell::marker {

/// Holds memory, so that it is used again without allocation.
class ConvexHull2d {
 public:
  void clear() {
    points_.clear();
    edges_.clear();
  }
  void add(double x, double y) { points_.push_back({x, y}); }

  /// Andrew's monotone chain. False where the points have no area between them.
  bool close() {
    edges_.clear();
    outline_.clear();
    if (points_.size() < 3) return false;
    std::sort(points_.begin(), points_.end(), [](Point a, Point b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
    chain(points_.begin(), points_.end());
    chain(points_.rbegin(), points_.rend());
    for (std::size_t i = 0; i < outline_.size(); ++i) {
      const Point a = outline_[i], b = outline_[(i + 1) % outline_.size()];
      const double length = std::hypot(b.x - a.x, b.y - a.y);
      if (!(length > 0)) continue;
      const double nx = (b.y - a.y) / length, ny = (a.x - b.x) / length;
      edges_.push_back({nx, ny, nx * a.x + ny * a.y});
    }
    return edges_.size() >= 3;
  }

  /// After close(): the largest distance beyond an edge's line; negative inside. Beyond a corner it is less than the
  /// distance to it.
  [[nodiscard]] double outside(double x, double y) const {
    double most = -std::numeric_limits<double>::infinity();
    for (const Edge& e : edges_) most = std::max(most, e.nx * x + e.ny * y - e.offset);
    return most;
  }

  /// After close(): likewise of many points at once. `Array`: of Eigen.
  template <class Array>
  void outside(const Array& x, const Array& y, Array& out) const {
    out = edges_[0].nx * x + edges_[0].ny * y - edges_[0].offset;
    for (std::size_t i = 1; i < edges_.size(); ++i)
      out = out.max(edges_[i].nx * x + edges_[i].ny * y - edges_[i].offset);
  }

  /// After close(): the x at height y that lie inside by `margin` or more; first > second where there are none.
  [[nodiscard]] std::pair<double, double> inside_at(double y, double margin) const {
    double first = -std::numeric_limits<double>::infinity(), last = std::numeric_limits<double>::infinity();
    for (const Edge& e : edges_) {
      const double room = e.offset - margin - e.ny * y;
      if (std::abs(e.nx) < 1e-12) {
        if (room < 0) return {1, 0};
      } else if (e.nx > 0) {
        last = std::min(last, room / e.nx);
      } else {
        first = std::max(first, room / e.nx);
      }
    }
    return {first, last};
  }

 private:
  struct Point {
    double x, y;
  };
  struct Edge {
    double nx, ny, offset;  // outward normal, of length one
  };

  template <class Iterator>
  void chain(Iterator begin, Iterator end) {
    const auto left = [](Point a, Point b, Point c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); };
    const std::size_t start = outline_.size();
    for (; begin != end; ++begin) {
      while (outline_.size() >= start + 2 && left(outline_[outline_.size() - 2], outline_.back(), *begin) <= 0)
        outline_.pop_back();
      outline_.push_back(*begin);
    }
    outline_.pop_back();
  }

  std::vector<Point> points_, outline_;
  std::vector<Edge> edges_;
};

}  // namespace lightwell::marker
