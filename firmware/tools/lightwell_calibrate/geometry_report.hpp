// Report of a geometric calibration: observed points and residuals.
#pragma once

#include <span>
#include <string>

#include <lightwell/result.hpp>

#include "calibration/solve/geometry/coverage.hpp"
#include "calibration/solve/geometry/geometry.hpp"

namespace lightwell::calibrate {

/// Draws a panel per lens: cells that lack views in red, points, and residuals enlarged a hundred times. `residuals`
/// may be empty. Writes .svg or .png, by the extension of `path`.
[[nodiscard]] Status draw_lenses(const calibration::BoardObservations& observations,
                                 std::span<const calibration::Coverage> coverage,
                                 std::span<const calibration::Residual> residuals, const std::string& title,
                                 const std::string& path);

}  // namespace lightwell::calibrate
