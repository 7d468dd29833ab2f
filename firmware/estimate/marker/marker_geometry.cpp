#include "estimate/marker/marker_geometry.hpp"

namespace lightwell::marker {
namespace {

/// Smallest cosine of the angle between down and the normal of a face on which the body may stand.
constexpr double kMinDownCosine = 0.64;
/// Smallest sine of the lens's elevation above the ground plane.
constexpr double kMinLensElevation = 0.12;
/// Number of points that represent the hull of a ball.
constexpr int kBallPoints = 48;

}  // namespace

PosedBody::PosedBody(const MarkerBody& body, const LensParameters& lens, const CameraModel& model,
                     const Pose& probe_body)
    : body_(body),
      model_(model),
      probe_body_(probe_body),
      lens_probe_(inverse(lens.pose_cv)),
      center_(body.ball ? body.ball->center : Vec3d{}),
      origin_(transformed(probe_body, center_)),
      lens_(lens.pose_cv.translation - origin_) {
  if (body.ball) {
    for (const Vec3d& direction : fibonacci_directions(kBallPoints)) hull_.push_back(direction * body.ball->radius_m);
    return;
  }
  for (const MarkerFace& face : body.faces)
    for (const FacePoint& p : face.outline) hull_.push_back(point_of(face, p));
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
