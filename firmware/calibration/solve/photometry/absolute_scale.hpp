// Absolute radiometric scale from one reading of a luminance or lux meter.
#pragma once

#include <array>

#include <lightwell/result.hpp>

#include "calibration/solve/photometry/patch.hpp"

namespace lightwell::photometry {

/// Luminance of the patch, cd/m², with its relative standard deviation.
struct MeterReading {
  double nits = 0;
  double deviation = 0;
};

/// Reading of a luminance meter. DIN 5032-7 allows 7.5 % for class B, about two standard deviations: 0.04.
[[nodiscard]] Result<MeterReading> luminance_reading(double nits, double deviation = 0.04);
/// Reading of a lux meter that lies on a matte surface of known albedo: nits = lux * albedo / pi.
[[nodiscard]] Result<MeterReading> illuminance_reading(double lux, double albedo, double deviation = 0.04,
                                                       double albedo_deviation = 0.02);

/// Exposure of the picture of the patch.
struct PatchExposure {
  double exposure_s = 0, gain = 1;
  double vignetting = 1;  ///< Mean relative illumination over the patch.
};

struct AbsoluteScale {
  double nits_per_unit = 0;  ///< RigParameters::nits_per_unit.
  double deviation = 0;      ///< Standard deviation, cd/m².
};

/// nits_per_unit = nits / (luminance of white_balance * x / (exposure_s * gain * vignetting)).
[[nodiscard]] Result<AbsoluteScale> solve_absolute_scale(const PatchMean& patch,
                                                         const std::array<double, 3>& white_balance,
                                                         const PatchExposure& exposure, const MeterReading& reading);

}  // namespace lightwell::photometry
