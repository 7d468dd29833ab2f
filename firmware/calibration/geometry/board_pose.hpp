// Where a flat board stands, from the directions in which its points are seen. Directions, not pixels: beyond 90
// degrees from the axis there is no plane to look at.
#pragma once

#include <optional>
#include <span>

#include <lightwell/geometry.hpp>

namespace lightwell::calibration {

/// T_lens_board in _cv axes, from at least four points that do not lie in one line: the homography between the board
/// and the bundle of rays (each ray crossed with its image is zero; Hartley & Zisserman 2004, section 4.1), taken apart
/// as Zhang 2000, section 3.1, does. Nothing where the points do not tell: fewer than four, in a line, in one place,
/// NaN.
[[nodiscard]] std::optional<Pose> board_pose(std::span<const Vec3d> points, std::span<const Vec3d> directions_cv);

}  // namespace lightwell::calibration
