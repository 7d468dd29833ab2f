// Photometry of a lens: between the numbers in a picture and radiance.
//   linear value x = (response^-1(v) - black) / (1 - black)
//   radiance = x / (exposure_s * gain * vignetting) * white_balance * scale
#pragma once

#include <vector>

#include <lightwell/calibration.hpp>

namespace lightwell {

/// Linear value (0 to 1) of a picture value (0 to 1), before the black level is taken off.
[[nodiscard]] double linearized(const ResponseCurve& response, double value);
/// The inverse: what the picture shows for a linear value; clamped to 0 and 1.
[[nodiscard]] double encoded(const ResponseCurve& response, double linear);

/// Linear value with the black level taken off and full scale kept at 1, for each of `levels` picture values: what a
/// reader of 8-, 10- or 12-bit pixels looks up. May be negative for noise below black.
[[nodiscard]] std::vector<float> linear_table(const PhotometricCalibration& photometry, int levels);

/// The least of `levels` picture values that counts as saturated; `levels` or more where none does.
[[nodiscard]] unsigned saturated_from(const PhotometricCalibration& photometry, int levels);

/// Relative illumination at an angle from the axis, 1 on it. Never below 0.05: a lens that dark sees nothing.
[[nodiscard]] double vignetting(const PhotometricCalibration& photometry, double angle_rad);

}  // namespace lightwell
