// The geometry of any lens: projection of directions to pixels and its inverse. Directions are in the lens frame, axes
// _cv: x right, y down, z forward. The centre of the top left pixel is (0, 0).
//   project    direction -> pixel          unproject  pixel -> direction
// CameraModel computes in double; CameraModelF in float, for many directions if an error of 1e-3 px is acceptable.
#pragma once

#include <optional>
#include <variant>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/model/double_sphere_camera.hpp"
#include "calibration/model/equirectangular_camera.hpp"
#include "calibration/model/kannala_brandt_camera.hpp"
#include "calibration/model/mei_camera.hpp"

namespace lightwell {

template <class T>
struct BasicPixelPosition {
  T x = 0, y = 0;
};
using PixelPosition = BasicPixelPosition<double>;
using PixelPositionF = BasicPixelPosition<float>;

/// The intrinsic geometry of one lens: one of the camera classes, and the field of view. A value type without
/// allocations. T: float or double.
template <class T>
class BasicCameraModel {
 public:
  /// `lens` must pass RigParameters::validate().
  explicit BasicCameraModel(const LensParameters& lens);

  /// Empty outside the model's domain: beyond max_angle_rad(), where the projection is no longer injective, or for
  /// zero, infinite and NaN. The direction need not be normalised. The pixel may lie outside the picture.
  [[nodiscard]] std::optional<BasicPixelPosition<T>> project(Vec3<T> direction_cv) const;

  /// A unit vector; empty if no direction within max_angle_rad() projects to the pixel.
  [[nodiscard]] std::optional<Vec3<T>> unproject(BasicPixelPosition<T> pixel) const;

  /// Half the field of view, rad, or the largest angle of the model's domain if that is smaller.
  [[nodiscard]] double max_angle_rad() const { return max_angle_; }

 private:
  std::variant<EquirectangularCamera<T>, KannalaBrandtCamera<T>, DoubleSphereCamera<T>, MeiCamera<T>> camera_;
  double max_angle_;
};

extern template class BasicCameraModel<double>;
extern template class BasicCameraModel<float>;
using CameraModel = BasicCameraModel<double>;
using CameraModelF = BasicCameraModel<float>;

}  // namespace lightwell
