// One edge of a tag next to a corner: traced along its steepest gradient, then fitted with a blurred-edge model.
// Private to firmware/pose.
#pragma once

#include <array>
#include <span>

#include <Eigen/Core>

#include "pose/grey_view.hpp"

namespace lightwell {

/// A grey picture with linearised values, 0 to 255.
class LinearPicture {
 public:
  /// `linear` has 256 entries, 0 to 1, or none if the pixel values are linear.
  LinearPicture(const GreyPicture& picture, std::span<const float> linear);

  [[nodiscard]] double at(int x, int y) const { return values_[picture_.at(x, y)]; }
  [[nodiscard]] bool holds(int x, int y) const { return x >= 0 && y >= 0 && x < picture_.width && y < picture_.height; }
  /// Samples bilinearly at `from`, `from + step`, ...; false if a sample lies outside the picture.
  [[nodiscard]] bool along(Eigen::Vector2d from, Eigen::Vector2d step, std::span<double> out) const;
  [[nodiscard]] int sides() const { return picture_.width + picture_.height; }
  /// Linear intensity of one step of the pixel values at the linear intensity `level`: 1 if the values are linear. The
  /// steps of an encoded picture (sRGB) are finer where it is dark.
  [[nodiscard]] double step_at(double level) const;

 private:
  GreyPicture picture_;
  std::array<double, 256> values_{};
};

/// Pixels closer to a corner are not used, px, because blur rounds it.
inline constexpr double kCornerMargin_px = 2.5;

/// The part of an edge next to a corner, in its own axes, px: s along the edge away from the corner, d outwards.
struct Edge {
  Eigen::Vector2d origin, along, out;
  double begin = 0, end = 0;                             ///< Range of s.
  double cell = 0;                                       ///< Width of the tag's cells perpendicular to the edge, px.
  Eigen::Vector3d curve = Eigen::Vector3d::Zero();       ///< d = c0 + c1 t + c2 t², t = s / end.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of `curve`, px².

  [[nodiscard]] double offset(double s) const {
    const double t = s / end;
    return curve[0] + t * (curve[1] + t * curve[2]);
  }
  [[nodiscard]] double slope(double s) const { return (curve[1] + 2 * curve[2] * s / end) / end; }
  [[nodiscard]] Eigen::Vector2d at(double s) const { return origin + along * s + out * offset(s); }
  [[nodiscard]] Eigen::Vector2d tangent(double s) const { return (along + out * slope(s)).normalized(); }
};

/// Fits a parabola to the middles of the steepest part of the outward ascent (times `sign`) within `reach` px of the
/// edge; sets `curve` and `covariance`. False if fewer than half of the points along the edge have enough contrast.
[[nodiscard]] bool trace_edge(const LinearPicture& picture, Edge& edge, double reach, double sign);

/// Fits the blurred-edge model, starting from `edge.curve`; sets `curve` and `covariance`. False if there is no
/// contrast of this `sign`, or the fit moved too far from its start.
[[nodiscard]] bool fit(const LinearPicture& picture, Edge& edge, double sign);

}  // namespace lightwell
