// What a calibration of geometry looks like: where points were seen, and by how much they miss.
#pragma once

#include <span>
#include <string>

#include <lightwell/result.hpp>

#include "calibration/geometry/coverage.hpp"
#include "calibration/geometry/geometry.hpp"

namespace lightwell::calibrate {

/// A panel a lens: cells that lack views in red, points, and residuals a hundred times enlarged. `residuals` may be
/// empty. A .svg or a .png, by its name.
[[nodiscard]] Status draw_lenses(const calibration::BoardObservations& observations,
                                 std::span<const calibration::Coverage> coverage,
                                 std::span<const calibration::Residual> residuals, const std::string& title,
                                 const std::string& path);

}  // namespace lightwell::calibrate
