// Convex hull in a plane (Andrew 1979, "Another efficient algorithm for convex hulls in two dimensions"), distances.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace lightwell::marker {

/// Keeps its memory when cleared.
class ConvexHull2d {
 public:
  void clear() {
    points_.clear();
    edges_.clear();
  }
  void add(double x, double y) { points_.push_back({x, y}); }

  /// Smallest and largest y of the points.
  [[nodiscard]] std::pair<double, double> y_range() const {
    const auto [first, last] =
        std::minmax_element(points_.begin(), points_.end(), [](Point a, Point b) { return a.y < b.y; });
    return {first->y, last->y};
  }

  /// Computes the hull (monotone chain). False where its area is zero.
  bool close() {
    edges_.clear();
    vertices_.clear();
    if (points_.size() < 3) return false;
    std::sort(points_.begin(), points_.end(), [](Point a, Point b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
    chain(points_.begin(), points_.end());
    chain(points_.rbegin(), points_.rend());
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      const Point a = vertices_[i], b = vertices_[(i + 1) % vertices_.size()];
      const double length = std::hypot(b.x - a.x, b.y - a.y);
      if (!(length > 0)) continue;
      const double nx = (b.y - a.y) / length, ny = (a.x - b.x) / length;
      edges_.push_back({nx, ny, nx * a.x + ny * a.y});
    }
    return edges_.size() >= 3;
  }

  /// After close(): the largest signed distance to an edge's line; negative inside, less than Euclidean at corners.
  [[nodiscard]] double signed_distance(double x, double y) const {
    double most = -std::numeric_limits<double>::infinity();
    for (const Edge& e : edges_) most = std::max(most, e.nx * x + e.ny * y - e.offset);
    return most;
  }

  /// After close(): the same for arrays of points. `Array`: an Eigen array.
  template <class Array>
  void signed_distance(const Array& x, const Array& y, Array& out) const {
    out = edges_[0].nx * x + edges_[0].ny * y - edges_[0].offset;
    for (std::size_t i = 1; i < edges_.size(); ++i)
      out = out.max(edges_[i].nx * x + edges_[i].ny * y - edges_[i].offset);
  }

  /// After close(): the interval of x on line y that is inside by at least `margin`; first > second where it is empty.
  [[nodiscard]] std::pair<double, double> inside_at(double y, double margin) const {
    double first = -std::numeric_limits<double>::infinity(), last = std::numeric_limits<double>::infinity();
    for (const Edge& e : edges_) {
      const double slack = e.offset - margin - e.ny * y;
      if (std::abs(e.nx) < 1e-12) {
        if (slack < 0) return {1, 0};
      } else if (e.nx > 0) {
        last = std::min(last, slack / e.nx);
      } else {
        first = std::max(first, slack / e.nx);
      }
    }
    return {first, last};
  }

 private:
  struct Point {
    double x, y;
  };
  struct Edge {
    double nx, ny, offset;  // unit outward normal; nx x + ny y = offset on the line
  };

  template <class Iterator>
  void chain(Iterator begin, Iterator end) {
    const auto left = [](Point a, Point b, Point c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); };
    const std::size_t start = vertices_.size();
    for (; begin != end; ++begin) {
      while (vertices_.size() >= start + 2 && left(vertices_[vertices_.size() - 2], vertices_.back(), *begin) <= 0)
        vertices_.pop_back();
      vertices_.push_back(*begin);
    }
    vertices_.pop_back();
  }

  std::vector<Point> points_, vertices_;
  std::vector<Edge> edges_;
};

}  // namespace lightwell::marker
