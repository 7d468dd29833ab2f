// Camera models: a pixel and a direction, both ways. Directions here are in the lens's own axes, _cv: x right, y down,
// z forward. Pixels: the centre of the top left one is (0, 0).
//   project    direction -> pixel          unproject  pixel -> direction
// CameraModel computes in double; CameraModelF in float, for many directions where 1e-3 px will do.
#pragma once

#include <array>
#include <optional>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell {

template <class T>
struct BasicPixelPosition {
  T x = 0, y = 0;
};
using PixelPosition = BasicPixelPosition<double>;
using PixelPositionF = BasicPixelPosition<float>;

/// One lens's geometry. A value: cheap to copy, nothing is allocated. T: float or double.
template <class T>
class BasicCameraModel {
 public:
  /// `lens` has passed RigParameters::validate().
  explicit BasicCameraModel(const LensParameters& lens);

  /// Nothing outside the model's domain: beyond max_angle_rad, where the projection turns back, or for zero and NaN.
  /// The direction need not be normalised. The pixel may lie outside the picture.
  [[nodiscard]] std::optional<BasicPixelPosition<T>> project(Vec3<T> direction_cv) const;

  /// A unit vector; nothing where no direction within max_angle_rad lands on the pixel.
  [[nodiscard]] std::optional<Vec3<T>> unproject(BasicPixelPosition<T> pixel) const;

  /// Half the field of view, or where the projection ends if that comes first.
  [[nodiscard]] double max_angle_rad() const { return max_angle_; }

 private:
  enum class Kind { kannala_brandt, double_sphere, mei, equirectangular };
  Kind kind_;
  std::array<T, 9> p_{};  ///< As projection.hpp orders them.
  int width_, height_;
  double max_angle_;
};

extern template class BasicCameraModel<double>;
extern template class BasicCameraModel<float>;
using CameraModel = BasicCameraModel<double>;
using CameraModelF = BasicCameraModel<float>;

}  // namespace lightwell
