// Helpers of the import tests: comparison with published formulas, and checks of errors.
#pragma once

#include <string>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/solve/import/import.hpp"
#include "published_formulas.hpp"

namespace lightwell::test {

/// Expects that lens and formula project all directions within max_angle_rad to the same pixel, to 1e-6 px.
void expect_same_pixels(const LensParameters& lens, const Formula& formula);

/// The imported calibration; on error a test failure with the message, and an empty rig.
[[nodiscard]] ImportedCalibration imported(const std::string& text, const ImportOptions& options = {});

/// `text` with `from`, which must occur in it, replaced by `to`.
[[nodiscard]] std::string with(std::string text, const std::string& from, const std::string& to);

/// Expects that the import fails with a message that contains all of `parts`.
void expect_refused(const std::string& text, const std::vector<std::string>& parts, const ImportOptions& options = {});

/// Whether one of the notes contains `part`.
[[nodiscard]] bool noted(const ImportedCalibration& imported, const std::string& part);

}  // namespace lightwell::test
