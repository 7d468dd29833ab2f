// Least-squares pose from observed tag corners with rejection of outlier tags. Shared by find_mounting(), whose world
// frame is the room, and find_body_pose(), whose world frame is the body. Private to firmware/pose.
//   solve_pose           local minimisation from a start, with a robust loss
//   consensus_pose       without a start: the pose that most tags agree on
//   find_inliers         the tags that agree with a pose
//   mirror_pose          the second attitude of a planar target
//   pose_covariance_of   the covariance of a solution
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "pose/mounting.hpp"
#include "pose/tag_directions.hpp"

namespace lightwell {

using Quads = std::vector<const ObservedTag*>;
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

/// The tags that agree with a pose: mean squared residual at most 25, and at most 25 times the lower median over the
/// tags, so that a model error common to all tags makes none an outlier.
[[nodiscard]] Quads find_inliers(const Quads& quads, const Pose& probe_world);

/// The second pose of a planar target with almost the same projection: the target's plane reflected in the plane
/// perpendicular to the line of sight (Schweighofer & Pinz 2006, section 3, without their perspective terms, for which
/// the solver corrects).
[[nodiscard]] Pose mirror_pose(const Quads& quads, const Pose& probe_world);

/// The covariance of probe_centroid if the covariances of the corners are correct; nullopt if the corners determine no
/// pose.
[[nodiscard]] std::optional<Matrix6d> pose_covariance_of(const CornerSolution& solution);

[[nodiscard]] PoseCovariance covariance_from(const Matrix6d& m);

/// RMS reprojection error of a tag's four corners, px; infinite if one of them projects outside the field of view.
[[nodiscard]] double rms_px(const PosedLens& lens, const TagObservation& observation, const WorldTag& tag,
                            const Pose& probe_world);

}  // namespace lightwell
