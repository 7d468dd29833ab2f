// How two lenses stand in the probe.
#pragma once

#include <array>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A rotation and a translation from the rows of a 4 x 4 matrix. The message names neither file nor field.
[[nodiscard]] Result<Pose> pose_of(const std::vector<std::vector<double>>& rows);

/// T_probe_lens of both, axes _cv, given T_c1_c0 (maps points of lens 0's camera into lens 1's): the probe's origin is
/// midway between the two, its -Z is lens 0's axis, and lens 0's picture is upright.
[[nodiscard]] std::array<Pose, 2> pair_in_probe(const Pose& second_from_first);

/// Between the two axes, rad: pi back to back.
[[nodiscard]] double angle_between_axes(const Pose& second_from_first);

}  // namespace lightwell
