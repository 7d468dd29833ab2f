// How sure a lamp's direction is, beyond what its own fit says.
//   multimodal_covariance   other places on the sphere
//   model_averaged_covariance   other models
//   carried       the same of a lamp that has moved
//   extent        how wide it could be
//   unexplained   light that lamps do not explain
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "estimate/marker/light_model_selector.hpp"

namespace lightwell::marker {

/// The covariance of one lamp's direction with all other places on the sphere in it that explain what was seen.
/// In tangent_basis(direction), rad².
[[nodiscard]] Eigen::Matrix2d multimodal_covariance(const Fit& best, std::size_t which, LightSearch& search, ObservationSet observation_set);

/// What the other models that were tried add to that, each by its likelihood. Zero where none was.
[[nodiscard]] Eigen::Matrix2d model_averaged_covariance(const FitCandidates& candidates, std::size_t which);

/// A covariance in tangent_basis(from) as it is in tangent_basis(to), a lamp having moved a little.
[[nodiscard]] Eigen::Matrix2d transport_covariance(const Eigen::Matrix2d& covariance, Vec3d from, Vec3d to);

/// A diffuse surface hardly tells a wide light from a point in its middle: what shines strongest may be anywhere in it.
/// The variance of that, along each axis, of the widest light that explains the faces as well. (A shadow's edge tells
/// that a lamp is small.)
[[nodiscard]] double source_size_variance(const Fit& best, std::size_t which, const LightSearch& search);

/// Light from all around that would be less than nothing on some side stands in for light that the lamps do not
/// explain. The variance of that in each direction, rad²; 0 where there is none.
[[nodiscard]] double model_misfit_variance(const LightModel& model);

}  // namespace lightwell::marker
