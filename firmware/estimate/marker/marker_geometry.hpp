// A body where it stands: its faces, its hull and its table in the probe's axes and in a lens's picture.
//   PosedBody      faces and ball relative to the centre, seen from one lens
#pragma once

#include <optional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/marker_body.hpp>

#include "calibration/camera_model.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// The point of a body that lights are told from: its ball's centre where it has one, else its frame's origin.
[[nodiscard]] Vec3d center_of(const MarkerBody& body);

class PosedBody {
 public:
  /// All three must outlive it.
  PosedBody(const MarkerBody& body, const LensParameters& lens, const CameraModel& model, const Pose& probe_body);

  /// Axes of the probe, from the body's centre, m.
  [[nodiscard]] Vec3d at(Vec3d point_of_body) const { return rotate(probe_body_.rotation, point_of_body - center_); }
  [[nodiscard]] Vec3d normal_of(const MarkerFace& face) const;
  [[nodiscard]] Vec3d point_of(const MarkerFace& face, FacePoint p) const {
    return at(transformed(face.body_face, {p.x, p.y, 0}));
  }
  /// Where the lens is, from the body's centre.
  [[nodiscard]] Vec3d lens() const { return lens_; }
  /// Of a point relative to the body's centre. Nothing where the lens does not see it.
  [[nodiscard]] std::optional<PixelPosition> pixel_of(Vec3d point) const;
  /// Points whose convex hull is the body, relative to its centre.
  [[nodiscard]] const std::vector<Vec3d>& hull() const { return hull_; }

  /// The plane that it stands on, without samples: its ball's sheet; else that of the face that looks down most, within
  /// 50 degrees of it and with the lens above. `up`: probe frame. Nothing where there is none.
  [[nodiscard]] std::optional<GroundPlane> table(Vec3d up) const;

 private:
  const MarkerBody& body_;
  const CameraModel& model_;
  Pose probe_body_, lens_probe_;
  Vec3d center_, origin_, lens_;
  std::vector<Vec3d> hull_;
};

}  // namespace lightwell::marker
