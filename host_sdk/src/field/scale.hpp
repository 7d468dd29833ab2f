// Factors that bring probes of different calibration scales together.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "field/place.hpp"
#include "field/views.hpp"

namespace lightwell::field {

struct ScaleEstimate {
  double log_scale = 0;
  double sigma = 0;  ///< Of log_scale.
};

/// Of each view: the factor that makes its lights agree with those of the others, by iteratively reweighted least
/// squares with the Cauchy loss on log(irradiance) + 2 log(distance) + log(scale) = log(intensity of the light): lamps
/// that shine unevenly lose their weight. Views of one calibration share a
/// factor. Absolute ones have the prior that its logarithm is 0 with the standard deviation `absolute_sigma`; without
/// an absolute view the factor of the calibration with the most matched lights is one.
[[nodiscard]] std::vector<ScaleEstimate> estimate_scales(std::span<const ProbeView> views,
                                                         std::span<const Observation> observations,
                                                         std::span<const Placed> lights, double absolute_sigma);

}  // namespace lightwell::field
