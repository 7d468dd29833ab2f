// The run as a picture: response with its samples, vignetting with the lamp, photon transfer with its levels.
#pragma once

#include <string>

#include <lightwell/result.hpp>

#include "tools/lightwell_calibrate/photometry_steps.hpp"

namespace lightwell::calibrate {

/// PNG. A step that was not taken shows the curve of the calibration without data.
[[nodiscard]] Status write_report(const PhotometryRun& run, const std::string& path);

}  // namespace lightwell::calibrate
