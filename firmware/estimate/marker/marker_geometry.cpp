#include "estimate/marker/marker_geometry.hpp"

#include <cmath>
#include <numbers>

#include "estimate/marker/fibonacci_directions.hpp"

namespace lightwell::marker {
namespace {

/// Smallest cosine of the angle between down and the normal of a face on which the body may stand.
constexpr double kMinDownCosine = 0.64;
/// Smallest sine of the lens's elevation above the ground plane.
constexpr double kMinLensElevation = 0.12;
/// Number of points that represent the hull of a ball.
constexpr int kBallPoints = 48;

}  // namespace

Vec3d center_of(const MarkerBody& body) { return body.ball ? body.ball->center : Vec3d{}; }

PosedBody::PosedBody(const MarkerBody& body, const LensParameters& lens, const CameraModel& model,
                     const Pose& probe_body)
    : body_(body),
      model_(model),
      probe_body_(probe_body),
      lens_probe_(inverse(lens.pose_cv)),
      center_(center_of(body)),
      origin_(transformed(probe_body, center_)),
      lens_(lens.pose_cv.translation - origin_) {
  if (body.ball) {
    for (const Vec3d& direction : fibonacci_directions(kBallPoints)) hull_.push_back(direction * body.ball->radius_m);
    return;
  }
  for (const MarkerFace& face : body.faces)
    for (const FacePoint& p : face.outline) hull_.push_back(point_of(face, p));
}

Vec3d PosedBody::normal_of(const MarkerFace& face) const {
  return rotate(probe_body_.rotation, rotate(face.body_face.rotation, Vec3d{0, 0, 1}));
}

std::optional<PixelPosition> PosedBody::pixel_of(Vec3d point) const {
  return model_.project(transformed(lens_probe_, point + origin_));
}

std::optional<GroundPlane> PosedBody::ground_plane(Vec3d up) const {
  const MarkerFace* lowest = nullptr;
  double most = kMinDownCosine;
  if (body_.ball) {
    lowest = &body_.faces.front();
  } else {
    for (const MarkerFace& face : body_.faces) {
      const double down = -dot(normal_of(face), up);
      if (down > most) most = down, lowest = &face;
    }
  }
  if (lowest == nullptr) return std::nullopt;
  GroundPlane out;
  out.point = point_of(*lowest, {0, 0});
  out.normal = body_.ball ? normal_of(*lowest) : -normal_of(*lowest);
  const Vec3d to_lens = lens_ - out.point;
  if (!(dot(to_lens, out.normal) > kMinLensElevation * length(to_lens))) return std::nullopt;
  return out;
}

}  // namespace lightwell::marker
