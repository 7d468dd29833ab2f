// Drawn report of a photometric calibration: response and its samples, vignetting and the lamp's observations, photon
// transfer curve and its levels.
#pragma once

#include <string>

#include <lightwell/result.hpp>

#include "tools/lightwell_calibrate/photometry_steps.hpp"

namespace lightwell::calibrate {

/// Writes a PNG. For a step without input it shows the curve of the calibration without data.
[[nodiscard]] Status write_report(const PhotometryRun& run, const std::string& path);

}  // namespace lightwell::calibrate
