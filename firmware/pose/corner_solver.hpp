// The pose that seen corners of tags agree on, and which tags do. What find_mounting() and find_body_pose() share: for
// the one the tags hang in a room, for the other on a body. For this room's sources.
//   solved        from a start downhill, with a robust loss
//   agreed        without a start: the pose that most tags agree on
//   agreeing      the tags that agree with a pose
//   flipped       the other attitude of a flat target
//   pose_covariance_of      the covariance of a solution
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

/// Solved for is where the middle of the corners is and how the world is turned about it: six numbers that hardly
/// depend on each other, wherever the world has its origin.
struct CornerSolution {
  Pose probe_middle;                                      ///< The world's axes, the origin moved to `middle`.
  Vec3d middle;                                           ///< World.
  double cost = std::numeric_limits<double>::infinity();  ///< Sum of squares after the loss.
  Matrix6d information = Matrix6d::Zero();                ///< Of probe_middle as UncertainPose has it, without a scale.
  /// Without the loss: two rows a corner, in the order of quads and corners, in standard deviations; and their slopes.
  Eigen::VectorXd residual;
  Eigen::Matrix<double, Eigen::Dynamic, 6> slope;

  [[nodiscard]] Pose probe_world() const { return compose(probe_middle, Pose{{}, -middle}); }
};

/// Where a corner's error, in standard deviations, begins to count less, and how steeply.
enum class Loss {
  cauchy,  ///< Cauchy's: what is far off hardly pulls.
  huber,       ///< Huber's.
};

struct SolverLimits {
  int iterations = 100;
  double tolerance = 1e-14;  ///< Share of the cost that a step must bring.
};

/// `quads` is not empty. The cost is infinite where no pose came out.
[[nodiscard]] CornerSolution solve_pose(const Quads& quads, const std::optional<GravityReading>& gravity,
                                    const Pose& probe_world, Loss loss, const SolverLimits& limits = {});

/// From every single tag's own pose and its mirror image as starts.
[[nodiscard]] CornerSolution consensus_pose(const Quads& quads, const std::optional<GravityReading>& gravity,
                                    const SolverLimits& limits = {});

/// Mean square of a tag's corners against a pose, in standard deviations.
[[nodiscard]] double mean_squared_residual(const ObservedTag& quad, const Pose& probe_world);

/// Those that agree with a pose, by the standard deviation of a corner. A model that is off by as much everywhere
/// contradicts nobody: what counts is to be much worse than the better half.
[[nodiscard]] Quads find_inliers(const Quads& quads, const Pose& probe_world);

/// The pose from which corners of a flat target look almost the same: the target's plane mirrored in the plane across
/// the line of sight (Schweighofer & Pinz 2006, section 3, without their perspective terms, which the solver adds).
[[nodiscard]] Pose mirror_pose(const Quads& quads, const Pose& probe_world);

/// The covariance of probe_middle for corners that are as exact as they say. Nothing where they determine no pose.
[[nodiscard]] std::optional<Matrix6d> pose_covariance_of(const CornerSolution& solution);

[[nodiscard]] PoseCovariance covariance_from(const Matrix6d& m);

/// In the picture, of a tag's four corners against a pose; infinite where the lens would not see one of them.
[[nodiscard]] double rms_px(const PosedLens& lens, const TagObservation& seen, const WorldTag& tag, const Pose& probe_world);

}  // namespace lightwell
