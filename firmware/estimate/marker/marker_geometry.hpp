// Geometry of a marker body at a pose: faces, hull and ground plane in the probe's axes, and their projection.
#pragma once

#include <optional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/fibonacci_lattice.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/marker_body.hpp>

#include "calibration/model/camera_model.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Evenly spaced: the `count` directions of fibonacci_direction(), from +Y to -Y.
[[nodiscard]] inline std::vector<Vec3d> fibonacci_directions(int count) {
  std::vector<Vec3d> out;
  for (int i = 0; i < count; ++i) {
    const Vec3d d = fibonacci_direction(i, count);
    out.push_back({d.y, d.z, d.x});
  }
  return out;
}

/// The origin of the lights' directions is the centre of the body: that of its ball, if it has one, else (0, 0, 0) of
/// the body frame.
class PosedBody {
 public:
  /// `body` and `model` are referenced and must outlive it. `probe_body`: T_probe_body.
  PosedBody(const MarkerBody& body, const LensParameters& lens, const CameraModel& model, const Pose& probe_body);

  /// Converts a point of the body frame to the probe's axes, relative to the body's centre, m.
  [[nodiscard]] Vec3d at(Vec3d point_of_body) const { return rotate(probe_body_.rotation, point_of_body - center_); }
  [[nodiscard]] Vec3d normal_of(const MarkerFace& face) const {
    return rotate(probe_body_.rotation, rotate(face.body_face.rotation, Vec3d{0, 0, 1}));
  }
  [[nodiscard]] Vec3d point_of(const MarkerFace& face, FacePoint p) const {
    return at(transformed(face.body_face, {p.x, p.y, 0}));
  }
  /// Position of the lens relative to the body's centre, m.
  [[nodiscard]] Vec3d lens() const { return lens_; }
  /// Projects a point relative to the body's centre. nullopt where it is outside of the lens's field of view.
  [[nodiscard]] std::optional<PixelPosition> pixel_of(Vec3d point) const {
    return model_.project(transformed(lens_probe_, point + origin_));
  }
  /// Points whose convex hull is the body, relative to its centre.
  [[nodiscard]] const std::vector<Vec3d>& hull() const { return hull_; }

  /// The plane on which the body stands, without samples: the ball's sheet, else that of the face whose normal points
  /// down most. nullopt where no face's normal is within 50 degrees of down (`up`: probe frame), or where the lens is
  /// less than 7 degrees above the plane.
  [[nodiscard]] std::optional<GroundPlane> ground_plane(Vec3d up) const;

 private:
  const MarkerBody& body_;
  const CameraModel& model_;
  Pose probe_body_, lens_probe_;
  Vec3d center_, origin_, lens_;
  std::vector<Vec3d> hull_;
};

}  // namespace lightwell::marker
