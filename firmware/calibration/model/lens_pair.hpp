// Poses of two lenses in the probe frame.
#pragma once

#include <array>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// The pose from the rows of a 4 x 4 homogeneous matrix. Callers add file and field to the error message.
[[nodiscard]] Result<Pose> pose_of(const std::vector<std::vector<double>>& rows);

/// T_probe_lens of both lenses, axes _cv, from T_c1_c0 (maps points from lens 0's frame to lens 1's). The probe's
/// origin is midway between the lenses, its -Z is lens 0's axis, and lens 0's picture is upright.
[[nodiscard]] std::array<Pose, 2> pair_in_probe(const Pose& second_from_first);

/// Angle between the two optical axes, rad; pi for lenses back to back.
[[nodiscard]] double angle_between_axes(const Pose& second_from_first);

}  // namespace lightwell
