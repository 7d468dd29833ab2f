#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <Eigen/Dense>

#include <lightwell/quantile.hpp>

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
/// The mean squared residual of a tag at which each of its corners has this loss.
const double kMaxMeanSquare = 4.5 * std::expm1(kMaxMeanLoss / 9);

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

/// Expected mean squared residual of a tag whose face has errors of its own.
double expected_residual(const ObservedTag& quad, const Pose& probe_body, const BodyPoseOptions& options) {
  const Pose probe_face = compose(probe_body, quad.tag->world_tag);
  double sum = 0;
  for (const CornerObservation& corner : quad.corners) {
    const Vec3d at = transformed(probe_body, corner.world);
    const double shift =
        std::hypot(options.face_shift_sigma_m, options.face_turn_sigma_rad * length(at - probe_face.translation)) /
        length(at - corner.lens);
    sum += shift * shift * corner.whitening.squaredNorm() / 2;
  }
  return 1 + sum / static_cast<double>(quad.corners.size());
}

Quads visible_inliers(const Quads& all, const Pose& probe_body, const BodyPoseOptions& options) {
  std::vector<double> expected;
  for (const ObservedTag* quad : all) expected.push_back(expected_residual(*quad, probe_body, options));
  Quads out = find_inliers(all, probe_body, expected);
  std::erase_if(out, [&](const ObservedTag* quad) { return !faces_the_lens(*quad, probe_body); });
  return out;
}

struct Consensus {
  CornerSolution solution;
  Quads used;
};

/// Inliers are consistent among themselves, also where a minimisation that diverged has no small residual.
bool fit(const Quads& inliers, const Pose& probe_body) {
  return std::ranges::all_of(
      inliers, [&](const ObservedTag* quad) { return mean_squared_residual(*quad, probe_body) < kMaxMeanSquare; });
}

/// The inlier tags and an approximate pose. Starts from the prediction; searches for a start with consensus_pose() if
/// that leads neither to a majority of the tags nor to tags that fit near the prediction. No majority: `used` is empty.
Consensus find_consensus(const Quads& all, const std::optional<BodyPrediction>& prediction,
                         const BodyPoseOptions& options) {
  Consensus out;
  const auto is_majority = [&] { return 2 * out.used.size() > all.size(); };
  if (prediction) {
    out.solution = solve_pose(all, std::nullopt, prediction->probe_body.pose, Loss::cauchy, kPredictedSolverLimits);
    if (std::isfinite(out.solution.cost)) {
      const Pose found = out.solution.probe_world();
      out.used = visible_inliers(all, found, options);
      const bool fits = out.solution.cost < kMaxMeanLoss * 4 * static_cast<double>(all.size());
      if (fits && is_majority()) return out;
      if (!out.used.empty() && fit(out.used, found) && is_near(prediction, found)) return out;
    }
  }
  out.solution = consensus_pose(all, std::nullopt, kPredictedSolverLimits);
  if (std::isfinite(out.solution.cost)) out.used = visible_inliers(all, out.solution.probe_world(), options);
  if (!is_majority()) out.used.clear();
  return out;
}

/// How the pose that minimises the squares follows from an error e that the residuals r + J x + e g do not model: it
/// moves by (J'J)⁻¹ J'g per unit of e.
class PoseResponse {
 public:
  explicit PoseResponse(const CornerSolution& solution)
      // Columns scaled to unit norm, because radians and metres have different magnitudes.
      : unit_(solution.jacobian.colwise().norm().cwiseInverse()),
        jacobian_(solution.jacobian * unit_.asDiagonal()),
        normal_(jacobian_.transpose() * jacobian_),
        known_(unit_.allFinite() && normal_.info() == Eigen::Success) {}

  struct Effect {
    Vector6d pose = Vector6d::Zero();  ///< Change of CornerSolution::probe_centroid.
    double squares = 0;                ///< Sum of squares of the residuals that remain.
  };
  [[nodiscard]] Effect of(const Eigen::VectorXd& g) const {
    Effect out;
    const Vector6d change = known_ ? Vector6d(normal_.solve(jacobian_.transpose() * g)) : Vector6d::Zero();
    if (!change.allFinite()) return out;
    out.pose = unit_.asDiagonal() * change;
    out.squares = (g - jacobian_ * change).squaredNorm();
    return out;
  }

 private:
  Vector6d unit_;
  Eigen::Matrix<double, Eigen::Dynamic, 6> jacobian_;
  Eigen::LDLT<Matrix6d> normal_;
  bool known_;
};

/// BodyPose::focal_jacobian of CornerSolution::probe_centroid. An equirectangular lens has no focal length and
/// contributes a zero derivative.
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
  return PoseResponse(solution).of(g).pose;
}

/// Effect of independent errors of the faces.
struct FaceErrors {
  Matrix6d covariance = Matrix6d::Zero();  ///< Of CornerSolution::probe_centroid.
  double squares = 0;                      ///< Expected increase of the sum of squared residuals.

  /// Expected reduced chi².
  [[nodiscard]] double expected(double freedom) const { return 1 + squares / freedom; }
};

FaceErrors face_errors_of(const Quads& quads, const CornerSolution& solution, const BodyPoseOptions& options) {
  FaceErrors out;
  const PoseResponse response(solution);
  const Pose probe_body = solution.probe_world();
  Eigen::VectorXd g(solution.residual.size());
  const auto is_first_view = [&](std::size_t q) {
    return std::none_of(quads.begin(), quads.begin() + static_cast<std::ptrdiff_t>(q),
                        [&](const ObservedTag* before) { return before->tag == quads[q]->tag; });
  };
  // Two lenses, or two observations, may show the same face.
  for (std::size_t q = 0; q < quads.size(); ++q) {
    if (!is_first_view(q)) continue;
    const Pose probe_face = compose(probe_body, quads[q]->tag->world_tag);
    for (int k = 0; k < 6; ++k) {
      const Vec3d axis =
          rotate(probe_face.rotation, Vec3d{k % 3 == 0 ? 1.0 : 0, k % 3 == 1 ? 1.0 : 0, k % 3 == 2 ? 1.0 : 0});
      const double sigma = k < 3 ? options.face_turn_sigma_rad : options.face_shift_sigma_m;
      g.setZero();
      Eigen::Index row = 0;
      for (const ObservedTag* quad : quads)
        for (const CornerObservation& corner : quad->corners) {
          const Vec3d at = transformed(probe_body, corner.world);
          const Vec3d change =
              (k < 3 ? cross(axis, at - probe_face.translation) : axis) * (sigma / length(at - corner.lens));
          if (quad->tag == quads[q]->tag)
            g.segment<2>(row) = corner.whitening * Eigen::Vector2d(dot(change, corner.u), dot(change, corner.v));
          row += 2;
        }
      const PoseResponse::Effect effect = response.of(g);
      out.covariance += effect.pose * effect.pose.transpose();
      out.squares += effect.squares;
    }
  }
  return out;
}

/// The two attitudes that minimise the cost. `best` has the smaller one, or is near the prediction if that is unclear.
struct Attitudes {
  CornerSolution best, other;
  double log_ratio = 0;  ///< PoseFit::alternative_excess.
  bool ambiguous = false;
};

Attitudes attitudes_of(const Consensus& consensus, const std::optional<BodyPrediction>& prediction, double freedom,
                       const BodyPoseOptions& options) {
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
  if (out.other.cost < out.best.cost) std::swap(out.best, out.other);
  const double expected = face_errors_of(consensus.used, out.best, options).expected(freedom);
  out.log_ratio = log_likelihood_ratio(out.best.cost / expected, out.other.cost / expected, freedom);
  out.ambiguous = out.log_ratio < kAmbiguousLogRatio;
  if (out.ambiguous && prediction && prediction->attitude_known) {
    const bool best_near = is_near(prediction, out.best.probe_world()),
               other_near = is_near(prediction, out.other.probe_world());
    if (best_near != other_near) {
      if (other_near) {
        std::swap(out.best, out.other);
        out.log_ratio = -out.log_ratio;
      }
      out.ambiguous = false;
    }
  }
  return out;
}

/// BodyPose::blur_px.
std::optional<double> blur_of(std::span<const TagObservation> observations, const Quads& used) {
  std::vector<double> blurs;
  for (const ObservedTag* quad : used)
    if (const std::optional<double> blur = observations[quad->index].tag.blur_px) blurs.push_back(*blur);
  if (blurs.empty()) return std::nullopt;
  return median(blurs);
}

std::string no_tag_reason(const ObservedTags& seen) {
  if (seen.reports.empty()) return "no tag is seen";
  if (seen.unknown == seen.reports.size())
    return "none of the " + std::to_string(seen.unknown) + " seen tags is one of the body's";
  return "no seen tag is usable: " + seen.reports.front().rejection_reason;
}

}  // namespace

Status BodyPoseOptions::validate() const {
  if (const Status s = MountingOptions::validate(); !s.ok()) return wrong(s.message());
  if (!(focal_sigma >= 0 && focal_sigma <= 0.5))
    return wrong("focal_sigma is " + std::to_string(focal_sigma) + "; it must be 0 to 0.5");
  if (!(face_turn_sigma_rad >= 0 && face_turn_sigma_rad <= 0.5))
    return wrong("face_turn_sigma_rad is " + std::to_string(face_turn_sigma_rad) + "; it must be 0 to 0.5");
  if (!(face_shift_sigma_m >= 0 && face_shift_sigma_m <= 0.1))
    return wrong("face_shift_sigma_m is " + std::to_string(face_shift_sigma_m) + "; it must be 0 to 0.1");
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
  const Consensus consensus = find_consensus(all, prediction, options);
  if (consensus.used.empty())
    return Status(StatusCode::failed_precondition,
                  "body: the " + std::to_string(all.size()) +
                      " tags seen of it contradict each other, no majority "
                      "agrees on a pose; check that the body is built as its file says, and that only one is in view");
  const double freedom = 8.0 * static_cast<double>(consensus.used.size()) - 6;
  const Attitudes found = attitudes_of(consensus, prediction, freedom, options);
  const std::optional<Matrix6d> noise =
      std::isfinite(found.best.cost) ? pose_covariance_of(found.best) : std::optional<Matrix6d>();
  if (!noise)
    return Status(StatusCode::failed_precondition,
                  "body: the corners seen do not determine a pose; it must be larger in the picture or less on edge");

  const Pose probe_body = found.best.probe_world();
  BodyPose out;
  out.used = static_cast<int>(consensus.used.size());
  out.blur_px = blur_of(observations, consensus.used);
  out.chi_square = found.best.cost / freedom;
  const Vector6d focal = focal_jacobian_of(rig, observations, consensus.used, found.best);
  const FaceErrors faces = face_errors_of(consensus.used, found.best, options);
  const double scale = std::max(1.0, found.best.residual.squaredNorm() / (freedom * faces.expected(freedom)));
  const Matrix6d covariance =
      scale * (*noise + faces.covariance) + options.focal_sigma * options.focal_sigma * focal * focal.transpose();
  const UncertainPose to_origin{Pose{{}, -found.best.centroid}, {}};
  const auto about_origin = [&](const Matrix6d& c) {
    return compose(UncertainPose{found.best.probe_centroid, covariance_from(c)}, to_origin);
  };
  out.probe_body = about_origin(covariance);
  out.face_covariance = about_origin(scale * faces.covariance).covariance;
  // A rotation about the corners' centroid also moves the body's origin.
  const Vec3d turn{focal[0], focal[1], focal[2]};
  const Vec3d moved = Vec3d{focal[3], focal[4], focal[5]} +
                      cross(turn, rotate(found.best.probe_centroid.rotation, -found.best.centroid));
  out.focal_jacobian = {turn.x, turn.y, turn.z, moved.x, moved.y, moved.z};
  if (std::isfinite(found.other.cost)) {
    out.alternative = found.other.probe_world();
    out.alternative_excess = found.log_ratio;
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
