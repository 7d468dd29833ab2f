// Photometric calibration of a lens: conversion between picture values and radiance.
//   linear value x = (response^-1(v) - black) / (1 - black)
//   radiance = x / (exposure_s * gain * vignetting) * white_balance * scale
#pragma once

#include <vector>

#include <lightwell/calibration.hpp>

namespace lightwell {

/// Linear value (0 to 1) of a picture value (0 to 1), before the black level is subtracted.
[[nodiscard]] double linearized(const ResponseCurve& response, double value);
/// Inverse of linearized(): picture value of a linear value, clamped to 0 to 1.
[[nodiscard]] double encoded(const ResponseCurve& response, double linear);

/// Linear value x of a picture value: the black level is subtracted, full scale is at 1.
[[nodiscard]] double linear_value(const PhotometricCalibration& photometry, double value);

/// Lookup table for 8-, 10- or 12-bit pixels: linear_value() of each of `levels` values. Negative below black.
[[nodiscard]] std::vector<float> linear_table(const PhotometricCalibration& photometry, int levels);

/// The smallest of `levels` picture values that counts as saturated; `levels` or more if none does.
[[nodiscard]] unsigned saturated_from(const PhotometricCalibration& photometry, int levels);

/// Relative illumination at an angle from the axis, 1 on the axis; limited to at least 0.05.
[[nodiscard]] double vignetting(const PhotometricCalibration& photometry, double angle_rad);

}  // namespace lightwell
