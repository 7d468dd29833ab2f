// The result of a photometric calibration as text and as JSON.
#pragma once

#include <string>

#include "tools/lightwell_calibrate/photometry_steps.hpp"

namespace lightwell::calibrate {

[[nodiscard]] std::string to_text(const PhotometryRun& run);
/// A JSON object; a step without input is null. Deviations are standard deviations in the unit of their value.
[[nodiscard]] std::string json_of(const PhotometryRun& run);

}  // namespace lightwell::calibrate
