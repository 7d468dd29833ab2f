// The geometry of any lens: projection of directions to pixels and its inverse. Directions are in the lens frame, axes
// _cv: x right, y down, z forward. The centre of the top left pixel is (0, 0).
#pragma once

#include <array>
#include <optional>
#include <variant>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "calibration/model/cameras.hpp"

namespace lightwell {

struct PixelPosition {
  double x = 0, y = 0;
};

/// The intrinsic geometry of one lens: one of the camera classes, and the field of view. Allocates nothing.
class CameraModel {
 public:
  /// `lens` must pass RigParameters::validate().
  explicit CameraModel(const LensParameters& lens);

  /// Empty outside the model's domain: beyond max_angle_rad(), where the projection is no longer injective, or for
  /// zero, infinite and NaN. The direction need not be normalised. The pixel may lie outside the picture.
  [[nodiscard]] std::optional<PixelPosition> project(Vec3d direction_cv) const;

  /// A unit vector; empty if no direction within max_angle_rad() projects to the pixel.
  [[nodiscard]] std::optional<Vec3d> unproject(PixelPosition pixel) const;

  /// Half the field of view, rad, or the largest angle of the model's domain if that is smaller.
  [[nodiscard]] double max_angle_rad() const { return max_angle_; }

 private:
  std::variant<EquirectangularCamera, KannalaBrandtCamera<double>, DoubleSphereCamera<double>, MeiCamera<double>>
      camera_;
  double max_angle_;
};

/// T_probe_lens of both lenses, axes _cv, from T_c1_c0 (maps points from lens 0's frame to lens 1's). The probe's
/// origin is midway between the lenses, its -Z is lens 0's axis, and lens 0's picture is upright.
[[nodiscard]] inline std::array<Pose, 2> pair_in_probe(const Pose& second_from_first) {
  const Quat first_from_second = second_from_first.rotation.inverse();
  // Position of lens 1 in lens 0's frame.
  const Vec3d place = -rotate(first_from_second, second_from_first.translation);
  const Vec3d half = rotate(upright_lens_cv(), place) * 0.5;
  return {Pose{upright_lens_cv(), -half}, Pose{(upright_lens_cv() * first_from_second).normalized(), half}};
}

}  // namespace lightwell
