// What tests of importing share: pixels beside a formula's, and refusals.
#pragma once

#include <string>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/import/import.hpp"
#include "published_formulas.hpp"

namespace lightwell::test {

/// The imported lens and the formula put every direction within max_angle_rad on the same pixel, to a millionth.
void expect_same_pixels(const LensParameters& lens, const Formula& formula);

/// Imported, or a failure with the message and an empty rig.
[[nodiscard]] ImportedCalibration imported(const std::string& text, const ImportOptions& options = {});

/// `text` with `from`, which must be there, replaced by `to`.
[[nodiscard]] std::string with(std::string text, const std::string& from, const std::string& to);

/// Not imported, and the message contains all of `parts`.
void expect_refused(const std::string& text, const std::vector<std::string>& parts, const ImportOptions& options = {});

/// Whether one of the notes contains `part`.
[[nodiscard]] bool noted(const ImportedCalibration& imported, const std::string& part);

}  // namespace lightwell::test
