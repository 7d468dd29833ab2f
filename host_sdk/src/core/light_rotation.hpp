// Rotation of lights and of their direction covariances.
#pragma once

#include <array>

#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell::core {

/// Transports the covariance of a direction, given in tangent_basis(from), by the rotation q into tangent_basis(to),
/// where `to` is approximately rotate(q, from). tangent_basis() does not commute with rotations, so the components
/// change even if the ellipse only moves with the direction.
[[nodiscard]] std::array<float, 3> transport_covariance(const std::array<float, 3>& covariance, Vec3f from, Quat q,
                                                        Vec3f to);

/// The light in a frame rotated by q: p_new = q p_old.
[[nodiscard]] Light rotate_light(const Light& light, Quat q);

/// The light's direction covariance plus that due to the rotation covariance of a pose. Both are in the light's current
/// frame.
[[nodiscard]] std::array<float, 3> add_pose_noise(const Light& light, const PoseCovariance& covariance);

}  // namespace lightwell::core
