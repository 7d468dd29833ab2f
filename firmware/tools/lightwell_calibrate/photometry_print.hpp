// The result of a photometric calibration as text and as JSON.
#pragma once

#include <string>

#include "tools/lightwell_calibrate/photometry_steps.hpp"

namespace lightwell::calibrate {

[[nodiscard]] std::string to_text(const PhotometryRun& run);
/// A line with a JSON object; a step without input is null. Deviations are standard deviations in the unit of their
/// value. "calibration" has values of the resulting calibration; "curves" is curves_of().
[[nodiscard]] std::string json_of(const PhotometryRun& run);

}  // namespace lightwell::calibrate
