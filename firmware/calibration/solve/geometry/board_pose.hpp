// Pose of a flat board from the directions of its points. Directions instead of pixels, because an image plane does not
// exist beyond 90 degrees from the axis.
#pragma once

#include <optional>
#include <span>

#include <lightwell/geometry.hpp>

namespace lightwell::calibration {

/// T_lens_board, axes _cv: the homography from the board to the rays by the direct linear transform (the cross product
/// of each ray with its mapped point is zero; Hartley & Zisserman 2004, section 4.1), decomposed as in Zhang 2000,
/// section 3.1. Empty if the points do not determine the pose: fewer than four, collinear, coincident, or NaN.
[[nodiscard]] std::optional<Pose> board_pose(std::span<const Vec3d> points, std::span<const Vec3d> directions_cv);

}  // namespace lightwell::calibration
