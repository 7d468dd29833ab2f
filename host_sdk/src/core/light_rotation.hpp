// Lights carried from one frame of axes, or one direction, to another.
#pragma once

#include <array>

#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell::core {

/// The covariance of a direction, given in tangent_basis(from), after the turn q, in
/// tangent_basis(to), where `to` is about rotate(q, from). The basis does not turn with its normal,
/// so the numbers change even where the ellipse only moves along.
[[nodiscard]] std::array<float, 3> transport_covariance(const std::array<float, 3>& covariance, Vec3f from, Quat q,
                                                      Vec3f to);

/// The light in a frame turned by q, p_new = q p_old.
[[nodiscard]] Light turned(const Light& light, Quat q);

/// The light's direction covariance with that of a frame's rotation added; both in the frame that the light is in now.
[[nodiscard]] std::array<float, 3> add_pose_noise(const Light& light, const PoseCovariance& covariance);

}  // namespace lightwell::core
