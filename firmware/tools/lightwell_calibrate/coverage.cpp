#include "tools/lightwell_calibrate/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lightwell::calibrate {

namespace {

/// Adds the part of an edge within one row, of signed `height`, from x0 to x1. Accumulates the derivative along the row
/// of the area to the right of the edge, so that a running sum gives the coverage.
void add_in_row(float* row, double x0, double x1, double height) {
  if (x0 > x1) std::swap(x0, x1);
  const double inclined = x1 - x0;
  const int first = static_cast<int>(std::floor(x0)), last = static_cast<int>(std::floor(x1));
  double before = 0;
  for (int i = first; i <= last; ++i) {
    const double from = std::max(x0, static_cast<double>(i)), to = std::min(x1, i + 1.0);
    const double part = inclined > 0 ? height * (to - from) / inclined : height;
    const double right_of_it = part * (i + 1 - (from + to) / 2);
    row[i] += static_cast<float>(before + right_of_it);
    before = part - right_of_it;
  }
  row[last + 1] += static_cast<float>(before);
}

}  // namespace

Coverage coverage_of(const std::vector<std::vector<PagePoint>>& outlines, double scale) {
  double x_min = std::numeric_limits<double>::max(), x_max = -x_min, y_min = x_min, y_max = -x_min;
  for (const auto& outline : outlines)
    for (const PagePoint& p : outline) {
      x_min = std::min(x_min, p.x * scale), x_max = std::max(x_max, p.x * scale);
      y_min = std::min(y_min, p.y * scale), y_max = std::max(y_max, p.y * scale);
    }
  Coverage out;
  if (!(x_min <= x_max)) return out;
  out.left = static_cast<int>(std::floor(x_min)), out.top = static_cast<int>(std::floor(y_min));
  // One more pixel on the right for the carry of an edge's last pixel, and one for rounding.
  out.width = static_cast<int>(std::floor(x_max)) - out.left + 3;
  out.height = static_cast<int>(std::floor(y_max)) - out.top + 1;
  out.share.assign(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height), 0.0F);
  for (const auto& outline : outlines)
    for (std::size_t i = 0; i < outline.size(); ++i) {
      PagePoint p{outline[i].x * scale - out.left, outline[i].y * scale - out.top};
      const PagePoint& next = outline[(i + 1) % outline.size()];
      PagePoint q{next.x * scale - out.left, next.y * scale - out.top};
      if (p.y == q.y) continue;
      const double sign = p.y < q.y ? 1 : -1;
      if (sign < 0) std::swap(p, q);
      const double slope = (q.x - p.x) / (q.y - p.y);
      const auto x_at = [&](double y) {
        return std::clamp(p.x + slope * (y - p.y), std::min(p.x, q.x), std::max(p.x, q.x));
      };
      for (int y = static_cast<int>(p.y); y < out.height && y < q.y; ++y) {
        const double from = std::max(p.y, static_cast<double>(y)), to = std::min(q.y, y + 1.0);
        if (to > from)
          add_in_row(&out.share[static_cast<std::size_t>(y * out.width)], x_at(from), x_at(to), sign * (to - from));
      }
    }
  for (int y = 0; y < out.height; ++y) {
    float sum = 0;
    for (int x = 0; x < out.width; ++x) {
      float& share = out.share[static_cast<std::size_t>(y * out.width + x)];
      sum += share;
      share = std::min(1.0F, std::abs(sum));
    }
  }
  return out;
}

}  // namespace lightwell::calibrate
