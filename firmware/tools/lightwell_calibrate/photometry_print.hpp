// What was measured, for people and for programs.
#pragma once

#include <string>

#include "tools/lightwell_calibrate/photometry_steps.hpp"

namespace lightwell::calibrate {

[[nodiscard]] std::string text_of(const PhotometryRun& run);
/// One object; a step that was not taken is null. Deviations are standard deviations in the unit of their value.
[[nodiscard]] std::string json_of(const PhotometryRun& run);

}  // namespace lightwell::calibrate
