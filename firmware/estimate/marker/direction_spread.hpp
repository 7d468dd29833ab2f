// How the direction of a light is distributed: the fit's own uncertainty, other directions, other models.
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "estimate/marker/light_model_selector.hpp"
#include "estimate/marker/light_search.hpp"

namespace lightwell::marker {

/// Distribution of a direction about the reported one: in one mode, and elsewhere.
struct DirectionSpread {
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< Of all, in tangent_basis(direction), rad².
  Eigen::Matrix2d main_mode = Eigen::Matrix2d::Zero();   ///< Of the part within kMinSeparation_rad.
  double elsewhere = 0;                                  ///< Probability of the rest.
};

/// Spread of the direction of light `which`: the fit's own Gaussian mixed with all directions of the grid, each
/// weighted by its likelihood to the power of 1 / dispersion.
[[nodiscard]] DirectionSpread multimodal_spread(const Fit& best, std::size_t which, LightSearch& search,
                                                ObservationSet observation_set);

/// Spread by the other models that were tried, weighted by exp(-BIC / 2) (Raftery 1995, "Bayesian model selection in
/// social research") to the power of 1/2, since the residuals are not quite independent (QAIC: Burnham & Anderson
/// 2002). Zero if no other model was tried.
[[nodiscard]] DirectionSpread model_spread(const FitCandidates& candidates, std::size_t which);

}  // namespace lightwell::marker
