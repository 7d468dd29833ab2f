// The extents of a set of points.
#pragma once

#include <algorithm>
#include <limits>

#include <lightwell/geometry.hpp>

namespace lightwell::viewer {

/// Axis-aligned; empty until the first point.
template <class T>
struct Box {
  static constexpr T kFar = std::numeric_limits<T>::max();
  Vec3<T> low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};

  void add(const Vec3<T>& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  // Of a box that is not empty.
  [[nodiscard]] Vec3<T> extent() const { return high - low; }
  [[nodiscard]] Vec3<T> center() const { return (low + high) * T(0.5); }
};

}  // namespace lightwell::viewer
