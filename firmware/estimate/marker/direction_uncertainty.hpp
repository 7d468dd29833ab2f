// Uncertainty of a light's direction beyond the covariance of its own fit.
//   multimodal_covariance       other directions on the sphere
//   model_averaged_covariance   other models (Bayesian model averaging)
//   transport_covariance        a covariance in the tangent plane of another direction
//   source_size_variance        possible size of the light
//   model_misfit_variance       light that point lights do not explain
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "estimate/marker/light_model_selector.hpp"

namespace lightwell::marker {

/// Covariance of the direction of light `which`: the fit's own Gaussian mixed with all directions of the grid, each
/// weighted by its likelihood. In tangent_basis(direction), rad².
[[nodiscard]] Eigen::Matrix2d multimodal_covariance(const Fit& best, std::size_t which, LightSearch& search,
                                                    ObservationSet observation_set);

/// Addition to that covariance by the other models that were tried, weighted by exp(-BIC / 2) (Raftery 1995, "Bayesian
/// model selection in social research"). Zero where no other model was tried.
[[nodiscard]] Eigen::Matrix2d model_averaged_covariance(const FitCandidates& candidates, std::size_t which);

/// Converts a covariance from tangent_basis(from) to tangent_basis(to); exact in the limit of a small rotation.
[[nodiscard]] Eigen::Matrix2d transport_covariance(const Eigen::Matrix2d& covariance, Vec3d from, Vec3d to);

/// Variance of the direction along each axis, rad², due to the unknown size of the light: that of the widest disc that
/// explains the faces as well. A diffuse surface hardly distinguishes a wide light from a point in its middle, and the
/// brightest part may be anywhere in it. (The sharpness of a shadow's edge limits the size; this function ignores it.)
[[nodiscard]] double source_size_variance(const Fit& best, std::size_t which, const LightSearch& search);

/// Variance of the direction along each axis, rad², where the fitted ambient irradiance is negative at some normal:
/// point lights then do not explain the light. Otherwise 0.
[[nodiscard]] double model_misfit_variance(const LightModel& model);

}  // namespace lightwell::marker
