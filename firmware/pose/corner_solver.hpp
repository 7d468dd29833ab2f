// Least-squares pose from observed tag corners with rejection of outlier tags. Shared by find_mounting(), whose world
// frame is the room, and find_body_pose(), whose world frame is the body. Private to firmware/pose.
#pragma once

#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "pose/mounting.hpp"

namespace lightwell {

[[nodiscard]] inline Eigen::Vector3d eigen(Vec3d v) { return {v.x, v.y, v.z}; }
[[nodiscard]] inline Vec3d vec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
[[nodiscard]] inline Quat quat(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

/// An observed corner whose position in the world is known.
struct CornerObservation {
  Vec3d world;                ///< Position of the corner, world frame, m.
  Vec3d lens;                 ///< Position of the lens, probe frame, m.
  Vec3d direction;            ///< Observed direction, unit vector, probe frame.
  Vec3d u, v;                 ///< Axes of the tangent plane at `direction`, probe frame.
  Eigen::Matrix2d whitening;  ///< Maps an error (u, v), rad, to independent components of variance 1.
};

/// The four corners of one tag in one lens.
struct ObservedTag {
  std::size_t index = 0;  ///< Index of the TagObservation.
  const WorldTag* tag = nullptr;
  std::vector<CornerObservation> corners;
  Pose probe_world;  ///< Algebraic estimate from this tag alone, accurate to a few pixels.
};

/// "tag36h11 5 in lens 0", as messages name it.
[[nodiscard]] std::string name_of(const TagObservation& observation);

using Quads = std::vector<const ObservedTag*>;

/// The observed tags with a known pose, as directions, and one report per observation.
struct ObservedTags {
  std::vector<ObservedTag> tags;
  std::vector<TagReport> reports;
  std::size_t unknown = 0;  ///< Number of observations of tags that are not in the world.

  [[nodiscard]] Quads all() const {
    Quads out;
    for (const ObservedTag& tag : tags) out.push_back(&tag);
    return out;
  }
};

/// `world` must outlive the result. Tags that are not in it are rejected with `unknown_reason`; corners that do not
/// determine the tag's pose with theirs. invalid_argument: NaN, an invalid covariance, a lens that the rig does not
/// have; with `unique` a tag twice in one lens.
[[nodiscard]] Result<ObservedTags> observed_tags(const PosedLenses& rig, std::span<const WorldTag> world,
                                                 std::span<const TagObservation> observations, double model_error_px,
                                                 const std::string& unknown_reason, bool unique);
/// Sets the residuals of all known tags in the reports, and which were used. Returns the RMS of those used, px.
[[nodiscard]] double report_residuals(const PosedLenses& rig, std::span<const TagObservation> observations,
                                      const Quads& used, const Pose& probe_world, ObservedTags& tags);

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// The parameters are the pose of a frame with the world's axes and its origin in the centroid of the corners: rotation
/// and translation are then almost uncorrelated, wherever the world frame has its origin.
struct CornerSolution {
  Pose probe_centroid;                                    ///< World axes, origin in `centroid`.
  Vec3d centroid;                                         ///< Of all corners, world frame.
  double cost = std::numeric_limits<double>::infinity();  ///< Sum of squared residuals after the loss.
  Matrix6d information = Matrix6d::Zero();  ///< Of probe_centroid, parameters as in UncertainPose, not scaled by chi².
  /// Residuals without the loss, in standard deviations: two rows per corner, in the order of quads and corners.
  Eigen::VectorXd residual;
  Eigen::Matrix<double, Eigen::Dynamic, 6> jacobian;  ///< Of `residual`.

  [[nodiscard]] Pose probe_world() const { return compose(probe_centroid, Pose{{}, -centroid}); }
};

/// Robust loss of a corner's residual.
enum class Loss {
  cauchy,  ///< Scale of 3 standard deviations; redescending, outliers have hardly any weight.
  huber,   ///< Scale of 4 standard deviations.
};

struct SolverLimits {
  int iterations = 100;
  double tolerance = 1e-14;  ///< Ceres' function_tolerance: relative decrease of the cost below which it stops.
};

/// Minimises from `probe_world`. `quads` is not empty. The cost is infinite if the solver fails.
[[nodiscard]] CornerSolution solve_pose(const Quads& quads, const std::optional<GravityReading>& gravity,
                                        const Pose& probe_world, Loss loss, const SolverLimits& limits = {});

/// The best of several minimisations, started from the pose of each single tag and its mirror pose.
[[nodiscard]] CornerSolution consensus_pose(const Quads& quads, const std::optional<GravityReading>& gravity,
                                            const SolverLimits& limits = {});

/// Mean squared residual of a tag's corners at a pose, in squared standard deviations.
[[nodiscard]] double mean_squared_residual(const ObservedTag& quad, const Pose& probe_world);

/// The tags that agree with a pose: mean squared residual, relative to the expected one, at most 25, and at most 25
/// times the lower median over the tags, so that a model error common to all tags makes none an outlier. `expected`: of
/// each tag, with its own model errors; empty: 1.
[[nodiscard]] Quads find_inliers(const Quads& quads, const Pose& probe_world, std::span<const double> expected = {});

/// The second pose of a planar target with almost the same projection: the target's plane reflected in the plane
/// perpendicular to the line of sight (Schweighofer & Pinz 2006, section 3, without perspective terms).
[[nodiscard]] Pose mirror_pose(const Quads& quads, const Pose& probe_world);

/// Value of log_likelihood_ratio() below which the second pose makes the result ambiguous: a ratio of 400. If both are
/// equally probable beforehand, the second one has a probability of 1 / 401.
inline const double kAmbiguousLogRatio = 2 * std::log(400.0);

/// Twice the logarithm of the likelihood ratio of two poses whose corners have the costs `best` and `other` (chi²),
/// with `freedom` degrees of freedom. The corners' variances are correct up to a common factor, whose prior is a scaled
/// inverse chi² distribution about 1. Integrated over the factor, the corners have a Student t distribution (Gelman et
/// al. 2013, section 17.2). Close to the difference of chi² if that is much smaller than `freedom`; negative if the
/// second pose has the smaller cost.
[[nodiscard]] double log_likelihood_ratio(double best, double other, double freedom);

/// False if two minimisations converged to the same attitude.
[[nodiscard]] bool are_distinct(const CornerSolution& a, const CornerSolution& b);

/// The covariance of probe_centroid if those of the corners are correct; nullopt if they determine no pose.
[[nodiscard]] std::optional<Matrix6d> pose_covariance_of(const CornerSolution& solution);

[[nodiscard]] PoseCovariance covariance_from(const Matrix6d& m);

}  // namespace lightwell
