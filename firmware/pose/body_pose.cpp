#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <Eigen/Dense>

#include "pose/body_tracker.hpp"
#include "pose/corner_solver.hpp"

namespace lightwell {

namespace {

/// A step that lowers chi² by less than 1e-7 of its value moves the pose by about a thousandth of its sigma.
constexpr SolverLimits kPredictedSolverLimits{30, 1e-7};
/// Gate of a prediction with six degrees of freedom. The 99.99 % quantile of chi² is 28; predictions are coarse.
constexpr double kMaxPredictionChiSquare = 50;
/// Mean cost of a corner after the Cauchy loss, in sigma²: a solution with less is in the basin of the right minimum.
constexpr double kMaxMeanLoss = 15;

Status wrong(const std::string& what) { return invalid_argument("body: " + what); }

/// Mahalanobis gate of `pose` against the prediction. The covariance of `pose` is neglected, being much smaller.
bool is_near(const std::optional<BodyPrediction>& prediction, const Pose& pose) {
  if (!prediction) return false;
  const Pose& before = prediction->probe_body.pose;
  const Quat q = pose.rotation * before.rotation.inverse();
  const double s = q.w < 0 ? -2 : 2;
  const Vec3d t = pose.translation - before.translation;
  Vector6d error;
  error << s * q.x, s * q.y, s * q.z, t.x, t.y, t.z;
  const Eigen::LLT<Matrix6d> root(
      Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(prediction->probe_body.covariance[0].data()));
  if (root.info() != Eigen::Success) return false;
  return error.dot(root.solve(error)) < kMaxPredictionChiSquare;
}

bool faces_the_lens(const ObservedTag& quad, const Pose& probe_body) {
  const Pose probe_face = compose(probe_body, quad.tag->world_tag);
  return dot(rotate(probe_face.rotation, Vec3d{0, 0, 1}), quad.corners[0].lens - probe_face.translation) > 0;
}

Quads visible_inliers(const Quads& all, const Pose& probe_body) {
  Quads out = find_inliers(all, probe_body);
  std::erase_if(out, [&](const ObservedTag* quad) { return !faces_the_lens(*quad, probe_body); });
  return out;
}

struct Consensus {
  CornerSolution solution;
  Quads used;
};

/// The inlier tags and an approximate pose. Starts from the prediction; searches for a start with consensus_pose() if
/// that leads neither to a majority of the tags nor to a pose near the prediction. No majority: `used` is empty.
Consensus find_consensus(const Quads& all, const std::optional<BodyPrediction>& prediction) {
  Consensus out;
  const auto is_majority = [&] { return 2 * out.used.size() > all.size(); };
  if (prediction) {
    out.solution = solve_pose(all, std::nullopt, prediction->probe_body.pose, Loss::cauchy, kPredictedSolverLimits);
    if (std::isfinite(out.solution.cost)) {
      const Pose found = out.solution.probe_world();
      out.used = visible_inliers(all, found);
      const bool fits = out.solution.cost < kMaxMeanLoss * 4 * static_cast<double>(all.size());
      if ((fits && is_majority()) || (!out.used.empty() && is_near(prediction, found))) return out;
    }
  }
  out.solution = consensus_pose(all, std::nullopt, kPredictedSolverLimits);
  if (std::isfinite(out.solution.cost)) out.used = visible_inliers(all, out.solution.probe_world());
  if (!is_majority()) out.used.clear();
  return out;
}

/// The two attitudes that minimise the cost. `best` has the smaller one, or is near the prediction if that is unclear.
struct Attitudes {
  CornerSolution best, other;
  bool ambiguous = false;
};

Attitudes attitudes_of(const Consensus& consensus, const std::optional<BodyPrediction>& prediction, double freedom) {
  Attitudes out;
  out.best =
      solve_pose(consensus.used, std::nullopt, consensus.solution.probe_world(), Loss::huber, kPredictedSolverLimits);
  if (!std::isfinite(out.best.cost)) return out;
  CornerSolution other = solve_pose(consensus.used, std::nullopt, mirror_pose(consensus.used, out.best.probe_world()),
                                    Loss::huber, kPredictedSolverLimits);
  if (!std::isfinite(other.cost) || !are_distinct(out.best, other)) return out;
  const Pose turned = other.probe_world();
  for (const ObservedTag* quad : consensus.used)
    if (!faces_the_lens(*quad, turned)) return out;
  out.other = std::move(other);
  const double scale = std::max(1.0, out.best.cost / freedom);
  out.ambiguous = out.other.cost - out.best.cost < kAmbiguousChiSquare * scale;
  if (out.ambiguous && prediction && prediction->attitude_known) {
    const bool best_near = is_near(prediction, out.best.probe_world()),
               other_near = is_near(prediction, out.other.probe_world());
    if (best_near != other_near) {
      if (other_near) std::swap(out.best, out.other);
      out.ambiguous = false;
    }
  }
  return out;
}

std::string no_tag_reason(const ObservedTags& seen) {
  if (seen.reports.empty()) return "no tag is seen";
  if (seen.unknown == seen.reports.size())
    return "none of the " + std::to_string(seen.unknown) + " seen tags is one of the body's";
  return "no seen tag is usable: " + seen.reports.front().rejection_reason;
}

/// BodyPose::focal_jacobian of CornerSolution::probe_centroid. Linear least squares in the six pose parameters x and
/// the relative focal length error e: residuals r + J x + e g. The pose was solved with e = 0, which moves it by
/// (J'J)⁻¹ J'g per unit of e. An equirectangular lens has no focal length and contributes a zero derivative.
Vector6d focal_jacobian_of(const PosedLenses& rig, std::span<const TagObservation> observations, const Quads& quads,
                           const CornerSolution& solution) {
  Eigen::VectorXd g = Eigen::VectorXd::Zero(solution.residual.size());
  Eigen::Index row = 0;
  for (const ObservedTag* quad : quads) {
    const TagObservation& tag = observations[quad->index];
    const PosedLens& lens = rig.at(tag.lens);
    const auto& axis = lens.axis;
    for (std::size_t i = 0; i < quad->corners.size(); ++i, row += 2) {
      const CornerObservation& corner = quad->corners[i];
      const PixelPosition p = tag.tag.corners[i];
      // One-sided difference towards the principal point (in the field of view). Shorter focal: pixel further out.
      constexpr double kStep = 1e-3;
      const auto moved =
          axis ? lens.model.unproject({p.x - kStep * (p.x - axis->x), p.y - kStep * (p.y - axis->y)}) : std::nullopt;
      if (!moved) continue;
      const Vec3d change = (rotate(lens.probe_lens.rotation, *moved) - corner.direction) * (-1 / kStep);
      g.segment<2>(row) = -(corner.whitening * Eigen::Vector2d(dot(change, corner.u), dot(change, corner.v)));
    }
  }
  // Columns scaled to unit norm, because radians and metres have different magnitudes.
  const Vector6d unit = solution.jacobian.colwise().norm().cwiseInverse();
  const Eigen::Matrix<double, Eigen::Dynamic, 6> jacobian = solution.jacobian * unit.asDiagonal();
  const Eigen::LDLT<Matrix6d> normal(jacobian.transpose() * jacobian);
  if (!unit.allFinite() || normal.info() != Eigen::Success) return Vector6d::Zero();
  const Vector6d pose_change = normal.solve(jacobian.transpose() * g);
  if (!pose_change.allFinite()) return Vector6d::Zero();
  return unit.asDiagonal() * pose_change;
}

}  // namespace

Status BodyPoseOptions::validate() const {
  if (const Status s = MountingOptions::validate(); !s.ok()) return wrong(s.message());
  if (!(focal_sigma >= 0 && focal_sigma <= 0.5))
    return wrong("focal_sigma is " + std::to_string(focal_sigma) + "; it must be 0 to 0.5");
  return {};
}

Result<std::vector<WorldTag>> tags_of(const MarkerBody& body) {
  const Result<TagFamily> family = parse_tag_family(body.tag_family);
  if (!family) return family.status();
  std::vector<WorldTag> out;
  for (const MarkerFace& face : body.faces) out.push_back({*family, face.tag_id, body.tag_size_m, face.body_face});
  return out;
}

Result<BodyPose> find_body_pose(const PosedLenses& rig, const MarkerBody& body,
                                std::span<const TagObservation> observations,
                                const std::optional<BodyPrediction>& prediction, const BodyPoseOptions& options) {
  if (const Status s = options.validate(); !s.ok()) return s;
  const Result<std::vector<WorldTag>> tags = tags_of(body);
  if (!tags) return tags.status();
  Result<ObservedTags> seen =
      observed_tags(rig, *tags, observations, options.model_error_px, "it is not one of the body's", /*unique=*/false);
  if (!seen) return wrong(seen.status().message());
  if (seen->tags.empty()) return Status(StatusCode::not_found, "body: " + no_tag_reason(*seen));
  const Quads all = seen->all();
  const Consensus consensus = find_consensus(all, prediction);
  if (consensus.used.empty())
    return Status(StatusCode::failed_precondition,
                  "body: the " + std::to_string(all.size()) +
                      " tags seen of it contradict each other, no majority "
                      "agrees on a pose; check that the body is built as its file says, and that only one is in view");
  const double freedom = 8.0 * static_cast<double>(consensus.used.size()) - 6;
  const Attitudes found = attitudes_of(consensus, prediction, freedom);
  const std::optional<Matrix6d> noise =
      std::isfinite(found.best.cost) ? pose_covariance_of(found.best) : std::optional<Matrix6d>();
  if (!noise)
    return Status(StatusCode::failed_precondition,
                  "body: the corners seen do not determine a pose; it must be larger in the picture or less on edge");

  const Pose probe_body = found.best.probe_world();
  BodyPose out;
  out.used = static_cast<int>(consensus.used.size());
  out.chi_square = found.best.cost / freedom;
  const Vector6d focal = focal_jacobian_of(rig, observations, consensus.used, found.best);
  const Matrix6d covariance =
      std::max(1.0, out.chi_square) * *noise + options.focal_sigma * options.focal_sigma * focal * focal.transpose();
  const UncertainPose to_origin{Pose{{}, -found.best.centroid}, {}};
  out.probe_body = compose(UncertainPose{found.best.probe_centroid, covariance_from(covariance)}, to_origin);
  // A rotation about the corners' centroid also moves the body's origin.
  const Vec3d turn{focal[0], focal[1], focal[2]};
  const Vec3d moved = Vec3d{focal[3], focal[4], focal[5]} +
                      cross(turn, rotate(found.best.probe_centroid.rotation, -found.best.centroid));
  out.focal_jacobian = {turn.x, turn.y, turn.z, moved.x, moved.y, moved.z};
  if (std::isfinite(found.other.cost)) {
    out.alternative = found.other.probe_world();
    out.alternative_excess = (found.other.cost - found.best.cost) / std::max(1.0, out.chi_square);
    out.ambiguous = found.ambiguous;
  }
  out.rms_px = report_residuals(rig, observations, consensus.used, probe_body, *seen);
  out.tags = std::move(seen->reports);
  for (const ObservedTag& quad : seen->tags)
    if (TagReport& report = out.tags[quad.index]; !report.used && !faces_the_lens(quad, probe_body))
      report.rejection_reason = "its face would be turned away";
  return out;
}

}  // namespace lightwell
