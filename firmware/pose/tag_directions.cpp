// Observed corners as directions in the probe frame, the initial pose from a single tag, and residuals in pixels.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include <Eigen/Dense>

#include "pose/corner_solver.hpp"

namespace lightwell {

namespace {

using Eigen::Vector3d;

/// Least width of the four corners relative to their length, for a tag 0.06 degrees from on edge; below, no plane.
constexpr double kMinRelativeWidth = 1e-3;

struct PlanePose {
  Pose pose;  ///< T_x_tag: x has the axes of the directions' frame, and its origin in the lens.
  std::string problem;
};

/// The tag's pose relative to the lens, in the frame of `directions`, by the direct linear transform from its plane to
/// directions (Hartley & Zisserman 2004, section 4.1, with rays instead of pixels, so that angles beyond 90 degrees
/// need no special case).
PlanePose plane_pose(const std::array<Vec3d, 4>& directions, double size_m) {
  // Reject directions on one great circle: the tag is seen edge on, or its corners are collinear.
  Eigen::Matrix<double, 4, 3> rays;
  Vector3d mean = Vector3d::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    rays.row(static_cast<Eigen::Index>(i)) = eigen(directions[i]).transpose();
    mean += eigen(directions[i]);
  }
  mean.normalize();
  Eigen::Matrix<double, 4, 3> perpendicular = rays - (rays * mean) * mean.transpose();
  perpendicular.rowwise() -= perpendicular.colwise().mean().eval();
  const Vector3d spread = perpendicular.jacobiSvd().singularValues();
  if (!(spread[0] > 0) || spread[1] < kMinRelativeWidth * spread[0])
    return {{}, "its corners lie in a line as seen from the lens, so that its plane cannot be determined"};
  // Seen from the front the corners run counterclockwise about the direction towards the viewer.
  double turn = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3d a = eigen(directions[i]) - mean, b = eigen(directions[(i + 1) % 4]) - mean;
    turn += a.cross(b).dot(-mean);
  }
  if (turn <= 0)
    return {{}, "its corners run clockwise: it is seen from behind or in a mirror, or they are in another order"};

  const std::array<Vec3d, 4> plane = tag_corners(2);
  Eigen::Matrix<double, 8, 9> system;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto basis = tangent_basis(directions[i]);
    const Vector3d at(plane[i].x, plane[i].y, 1);
    for (std::size_t k = 0; k < 2; ++k) {
      const Vector3d b = eigen(basis[k]);
      const auto row = static_cast<Eigen::Index>(2 * i + k);
      for (int c = 0; c < 3; ++c) system.block<1, 3>(row, 3 * c) = at[c] * b.transpose();
    }
  }
  const Eigen::JacobiSVD<Eigen::Matrix<double, 8, 9>> svd(system, Eigen::ComputeFullV);
  const Eigen::Matrix<double, 9, 1> h = svd.matrixV().col(8);
  Vector3d x = h.segment<3>(0), y = h.segment<3>(3), t = h.segment<3>(6);
  if (t.dot(mean) < 0) {
    x = -x;
    y = -y;
    t = -t;
  }
  for (std::size_t i = 0; i < 4; ++i)
    if (!((x * plane[i].x + y * plane[i].y + t).dot(eigen(directions[i])) > 0))
      return {{}, "its corners cannot be those of a square in front of the lens; a part of it would be behind"};
  const double scale = (x.norm() + y.norm()) / 2;
  Eigen::Matrix3d approximate;
  approximate << x / scale, y / scale, (x / scale).cross(y / scale).normalized();
  const Eigen::JacobiSVD<Eigen::Matrix3d> nearest(approximate, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d r = nearest.matrixU() * nearest.matrixV().transpose();
  if (r.determinant() < 0) r.col(2) = -r.col(2);
  return {{quat(Eigen::Quaterniond(r)).normalized(), vec(t / scale * (size_m / 2))}, {}};
}

/// Unprojects the corners of `observation`; ObservedTag::index is left 0 and `tag` must outlive the result.
/// invalid_argument: NaN or an invalid covariance. failed_precondition: corners that do not determine the tag's pose.
Result<ObservedTag> directions_of(const PosedLens& lens, const TagObservation& observation, const WorldTag& tag,
                                  double model_error_px) {
  const auto wrong = [&](const std::string& what) { return invalid_argument(name_of(observation) + ": " + what); };
  const auto unusable = [&](const std::string& what) {
    return Status(StatusCode::failed_precondition, name_of(observation) + ": " + what);
  };
  const CameraModel& model = lens.model;
  const Quat to_probe = lens.probe_lens.rotation;
  const std::array<Vec3d, 4> at = tag_corners(tag.size_m);
  ObservedTag out;
  out.tag = &tag;
  std::array<Vec3d, 4> directions;
  for (std::size_t i = 0; i < 4; ++i) {
    const PixelPosition p = observation.tag.corners[i];
    const PixelCovariance c = observation.tag.covariance[i];
    const std::string corner = "corner " + std::to_string(i);
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return wrong(corner + " is not a number");
    if (!(c.xx > 0 && c.yy > 0 && c.xx * c.yy > c.xy * c.xy) || !std::isfinite(c.xx + c.yy))
      return wrong(corner + "'s covariance is not positive definite");
    const auto d = model.unproject(p);
    if (!d) return unusable(corner + " is outside the lens's field of view");
    CornerObservation seen_corner;
    seen_corner.world = transformed(tag.world_tag, at[i]);
    seen_corner.lens = lens.probe_lens.translation;
    seen_corner.direction = directions[i] = normalized(rotate(to_probe, *d));
    const auto basis = tangent_basis(seen_corner.direction);
    seen_corner.u = basis[0];
    seen_corner.v = basis[1];
    // Jacobian from pixels to the tangent plane, by one-sided differences within the field of view.
    Eigen::Matrix2d jacobian;
    for (int k = 0; k < 2; ++k) {
      constexpr double kStep = 0.05;
      bool done = false;
      for (const double step : {kStep, -kStep}) {
        const auto moved = model.unproject({p.x + (k == 0 ? step : 0), p.y + (k == 1 ? step : 0)});
        if (!moved) continue;
        const Vec3d change = rotate(to_probe, *moved - *d) * (1 / step);
        jacobian(0, k) = dot(change, basis[0]);
        jacobian(1, k) = dot(change, basis[1]);
        done = true;
        break;
      }
      if (!done) return unusable(corner + " is on the very edge of the lens's field of view");
    }
    Eigen::Matrix2d covariance;
    const double more = model_error_px * model_error_px;
    covariance << c.xx + more, c.xy, c.xy, c.yy + more;
    const Eigen::Matrix2d angular = jacobian * covariance * jacobian.transpose();
    const Eigen::LLT<Eigen::Matrix2d> root(angular);
    if (root.info() != Eigen::Success) return unusable(corner + ": the camera model is singular there");
    seen_corner.whitening = root.matrixL().solve(Eigen::Matrix2d::Identity());
    out.corners.push_back(seen_corner);
  }
  const PlanePose found = plane_pose(directions, tag.size_m);
  if (!found.problem.empty()) return unusable(found.problem);
  Pose probe_tag = found.pose;
  probe_tag.translation += lens.probe_lens.translation;
  out.probe_world = compose(probe_tag, inverse(tag.world_tag));
  out.probe_world.rotation = out.probe_world.rotation.normalized();
  return out;
}

/// RMS reprojection error of a tag's four corners, px; infinite if one of them projects outside the field of view.
double rms_px(const PosedLens& lens, const TagObservation& observation, const WorldTag& tag, const Pose& probe_world) {
  const Pose lens_world = compose(inverse(lens.probe_lens), probe_world);
  double sum = 0;
  const auto at = tag_corners(tag.size_m);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = lens.model.project(transformed(lens_world, transformed(tag.world_tag, at[i])));
    if (!p) return std::numeric_limits<double>::infinity();
    const PixelPosition observed = observation.tag.corners[i];
    sum += (p->x - observed.x) * (p->x - observed.x) + (p->y - observed.y) * (p->y - observed.y);
  }
  return std::sqrt(sum / 4);
}

}  // namespace

std::string name_of(const TagObservation& observation) {
  return std::string(to_string(observation.tag.family)) + " " + std::to_string(observation.tag.id) + " in lens " +
         std::to_string(observation.lens);
}

Result<ObservedTags> observed_tags(const PosedLenses& rig, std::span<const WorldTag> world,
                                   std::span<const TagObservation> observations, double model_error_px,
                                   const std::string& unknown_reason, bool unique) {
  ObservedTags out;
  std::set<std::tuple<int, TagFamily, int>> seen;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const TagObservation& s = observations[i];
    const auto wrong = [&](const std::string& what) { return invalid_argument(name_of(s) + what); };
    if (!rig.has(s.lens)) return wrong(": the rig has " + std::to_string(rig.lenses.size()) + " lenses");
    TagReport& report = out.reports.emplace_back(TagReport{s.lens, s.tag.family, s.tag.id, 0, false, unknown_reason});
    const auto tag = std::find_if(world.begin(), world.end(),
                                  [&](const WorldTag& t) { return t.family == s.tag.family && t.id == s.tag.id; });
    if (tag == world.end()) {
      ++out.unknown;
      continue;
    }
    if (unique && !seen.emplace(s.lens, s.tag.family, s.tag.id).second)
      return wrong(" is seen twice; a tag number may occur only once in the room");
    Result<ObservedTag> quad = directions_of(rig.at(s.lens), s, *tag, model_error_px);
    if (!quad && quad.status().code() == StatusCode::invalid_argument) return quad.status();
    report.rejection_reason = quad.status().message();
    if (!quad) continue;
    quad->index = i;
    out.tags.push_back(std::move(*quad));
  }
  return out;
}

double report_residuals(const PosedLenses& rig, std::span<const TagObservation> observations, const Quads& used,
                        const Pose& probe_world, ObservedTags& tags) {
  double squares = 0;
  for (const ObservedTag& quad : tags.tags) {
    const TagObservation& observation = observations[quad.index];
    TagReport& report = tags.reports[quad.index];
    report.rms_px = rms_px(rig.at(observation.lens), observation, *quad.tag, probe_world);
    report.used = std::find(used.begin(), used.end(), &quad) != used.end();
    if (report.used)
      squares += report.rms_px * report.rms_px;
    else
      report.rejection_reason = "it contradicts the others";
  }
  return std::sqrt(squares / static_cast<double>(used.size()));
}

}  // namespace lightwell
