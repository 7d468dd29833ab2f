// The absolute scale from one reading of a meter.
#pragma once

#include <array>

#include <lightwell/result.hpp>

#include "calibration/photometry/patch.hpp"

namespace lightwell::photometry {

/// What is known of the patch in cd/m². Deviations are relative.
struct MeterReading {
  double nits = 0;
  double deviation = 0;
};

/// A luminance meter's. DIN 5032-7 allows class B 7.5 %, about two deviations: 0.04.
[[nodiscard]] Result<MeterReading> luminance_reading(double nits, double deviation = 0.04);
/// A lux meter's, lying on a matte grey of known albedo: nits = lux * albedo / pi.
[[nodiscard]] Result<MeterReading> illuminance_reading(double lux, double albedo, double deviation = 0.04,
                                                       double albedo_deviation = 0.02);

/// How the patch was seen.
struct PatchExposure {
  double exposure_s = 0, gain = 1;
  double vignetting = 1;  ///< Relative illumination where the patch is, its mean.
};

struct AbsoluteScale {
  double nits_per_unit = 0;  ///< RigParameters'.
  double deviation = 0;      ///< Of the same, cd/m².
};

/// nits_per_unit = nits / (luminance of white_balance * x / (exposure_s * gain * vignetting)).
[[nodiscard]] Result<AbsoluteScale> solve_absolute_scale(const PatchMean& patch,
                                                         const std::array<double, 3>& white_balance,
                                                         const PatchExposure& exposure, const MeterReading& reading);

}  // namespace lightwell::photometry
