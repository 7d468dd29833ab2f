// Initial estimates for the bundle adjustment.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/geometry/board_observations.hpp"
#include "calibration/solve/geometry/bundle.hpp"

namespace lightwell::calibration {

/// T_lens_board, axes _cv, of a flat board from the directions of its points: the homography from the board to the rays
/// by the direct linear transform (the cross product of each ray with its mapped point is zero; Hartley & Zisserman
/// 2004, section 4.1), decomposed as in Zhang 2000, section 3.1. Empty for less than four points, collinear ones, NaN.
[[nodiscard]] std::optional<Pose> board_pose(std::span<const Vec3d> points, std::span<const Vec3d> directions_cv);

/// Initial estimate of one lens, with an independent pose for each board in each picture.
struct LensInitialization {
  KannalaBrandtParameters lens;
  double rms_px = 0;
  /// T_lens_board by picture of BoardObservations and board; empty for other lenses and for too few observations.
  std::vector<std::vector<std::optional<Pose>>> board_poses;
  double tilt_rad = 0;  ///< Largest angle between the normals of two boards in the lens frame.
};

/// Starts from equidistant lenses with several fields of view, refines each, and returns the best.
[[nodiscard]] Result<LensInitialization> initialize_lens(const BoardObservations& observations, int lens);

/// Chains the poses of the individual lenses: rig poses, and relative poses of boards and lenses. failed_precondition
/// names a capture, board or lens that is not connected to the others.
[[nodiscard]] Result<BundleState> initialize_bundle(const BoardObservations& observations,
                                                    const std::vector<LensInitialization>& lenses);

/// The model of this kind that best approximates `lens` up to `max_model_angle_rad`; all zero if it cannot.
[[nodiscard]] ModelParameters equivalent_model(const KannalaBrandtParameters& lens, LensKind kind,
                                               double max_model_angle_rad);

}  // namespace lightwell::calibration
