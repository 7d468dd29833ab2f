// How sure a lamp's direction is, beyond what its own fit says.
//   over_places   other places on the sphere
//   over_models   other models
//   carried       the same of a lamp that has moved
//   extent        how wide it could be
//   unexplained   light that lamps do not explain
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "estimate/marker/lamp_chooser.hpp"

namespace lightwell::marker {

/// The covariance of one lamp's direction with all other places on the sphere in it that explain what was seen.
/// In tangent_basis(direction), rad².
[[nodiscard]] Eigen::Matrix2d over_places(const Fit& best, std::size_t which, LightSearch& search, Witness witness);

/// What the other models that were tried add to that, each by its likelihood. Zero where none was.
[[nodiscard]] Eigen::Matrix2d over_models(const Sought& sought, std::size_t which);

/// A covariance in tangent_basis(from) as it is in tangent_basis(to), a lamp having moved a little.
[[nodiscard]] Eigen::Matrix2d carried(const Eigen::Matrix2d& covariance, Vec3d from, Vec3d to);

/// A diffuse surface hardly tells a wide light from a point in its middle: what shines strongest may be anywhere in it.
/// The variance of that, along each axis, of the widest light that explains the faces as well. (A shadow's edge tells
/// that a lamp is small.)
[[nodiscard]] double extent(const Fit& best, std::size_t which, const LightSearch& search);

/// Light from all around that would be less than nothing on some side stands in for light that the lamps do not
/// explain. The variance of that in each direction, rad²; 0 where there is none.
[[nodiscard]] double unexplained(const LightModel& model);

}  // namespace lightwell::marker
