// One edge of a tag next to a corner: followed first, then fitted to the light on both sides. For this room's sources.
#pragma once

#include <array>
#include <span>

#include <Eigen/Core>

#include "pose/grey_picture.hpp"

namespace lightwell {

/// Linear values, 0 to 255.
class LinearPicture {
 public:
  /// `linear` has 256 entries, 0 to 1, or none where values are linear.
  LinearPicture(const GreyPicture& picture, std::span<const float> linear);

  [[nodiscard]] double at(int x, int y) const { return values_[picture_.at(x, y)]; }
  [[nodiscard]] bool holds(int x, int y) const { return x >= 0 && y >= 0 && x < picture_.width && y < picture_.height; }
  /// Between pixels, at `from`, `from + step` and so on; false where a part of that lies outside.
  [[nodiscard]] bool along(Eigen::Vector2d from, Eigen::Vector2d step, std::span<double> out) const;
  [[nodiscard]] int sides() const { return picture_.width + picture_.height; }

 private:
  GreyPicture picture_;
  std::array<double, 256> values_{};
};

/// The part of an edge next to a corner, in axes of its own: s along the edge away from the corner, d outwards.
struct Edge {
  Eigen::Vector2d origin, along, out;
  double begin = 0, end = 0;                        ///< Of s.
  double cell = 0;                                  ///< Width of the tag's cells across the edge, px.
  Eigen::Vector3d curve = Eigen::Vector3d::Zero();  ///< d = c0 + c1 t + c2 t², t = s / end.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  [[nodiscard]] double offset(double s) const {
    const double t = s / end;
    return curve[0] + t * (curve[1] + t * curve[2]);
  }
  [[nodiscard]] double slope(double s) const { return (curve[1] + 2 * curve[2] * s / end) / end; }
  [[nodiscard]] Eigen::Vector2d at(double s) const { return origin + along * s + out * offset(s); }
  [[nodiscard]] Eigen::Vector2d tangent(double s) const { return (along + out * slope(s)).normalized(); }
};

/// A parabola through the places where the picture grows fastest outwards (times `sign`), at most `reach` px aside;
/// fills `curve` and `covariance`. False where there is no edge for half of the way.
[[nodiscard]] bool trace_edge(const LinearPicture& picture, Edge& edge, double reach, double sign);

/// The blurred edge itself, from where `edge.curve` says it is; fills `curve` and `covariance`. False where there is no
/// contrast of the right `sign`, or the fit went elsewhere.
[[nodiscard]] bool fit(const LinearPicture& picture, Edge& edge, double sign);

}  // namespace lightwell
