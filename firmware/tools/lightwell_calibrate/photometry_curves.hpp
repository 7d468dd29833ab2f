// The curves of a photometric calibration and the measurements that they were fitted to, as JSON for a drawing.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "tools/lightwell_calibrate/photometry_steps.hpp"

namespace lightwell::calibrate {

/// An object with "response", "vignetting" and "noise". Each has "curve", a list of [x, y] of the calibration, and
/// "points", a list of [x, y, standard deviation of y, whether it counted], which is empty for a step without input.
///   response    linear light and picture value, shares of full scale; all outliers, at most 300 others, deviation 0
///   vignetting  degrees from the axis, illumination relative to that on the axis; its curve has the standard deviation
///               of y as a third number, 0 without input
///   noise       linear light x divided by the gain, variance of x at gain 1
[[nodiscard]] nlohmann::ordered_json curves_of(const PhotometryRun& run);

}  // namespace lightwell::calibrate
