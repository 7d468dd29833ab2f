#include "calibration/solve/photometry/absolute_scale.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include <lightwell/color.hpp>

namespace lightwell::photometry {
namespace {

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, "absolute scale: " + what}; }
bool positive(double v) { return v > 0 && std::isfinite(v); }

}  // namespace

Result<MeterReading> luminance_reading(double nits, double deviation) {
  if (!positive(nits)) return invalid("the luminance must be positive, in cd/m²");
  if (!(deviation >= 0 && deviation < 1)) return invalid("the meter's relative deviation must be 0 to 1");
  return MeterReading{nits, deviation};
}

Result<MeterReading> illuminance_reading(double lux, double albedo, double deviation, double albedo_deviation) {
  if (!positive(lux)) return invalid("the illuminance must be positive, in lux");
  if (!(albedo > 0 && albedo <= 1)) return invalid("the albedo must be above 0 and at most 1; a grey card's is 0.18");
  if (!(deviation >= 0 && deviation < 1) || !(albedo_deviation >= 0 && albedo_deviation < 1))
    return invalid("the relative deviations of meter and albedo must be 0 to 1");
  return MeterReading{lux * albedo / std::numbers::pi, std::hypot(deviation, albedo_deviation)};
}

Result<AbsoluteScale> solve_absolute_scale(const PatchMean& patch, const std::array<double, 3>& white_balance,
                                           const PatchExposure& exposure, const MeterReading& reading) {
  if (!positive(reading.nits) || !(reading.deviation >= 0)) return invalid("the reading must be positive");
  if (!positive(exposure.exposure_s) || !positive(exposure.gain))
    return invalid("exposure and gain of the patch's picture must be given and positive");
  if (!(exposure.vignetting >= 0.05))
    return invalid("the vignetting at the patch is too strong; put the patch into the middle of the picture");
  std::array<double, 3> seen{};
  double variance = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!positive(patch.mean[c]) || !positive(white_balance[c]))
      return invalid("a channel of the patch is not positive");
    seen[c] = white_balance[c] * patch.mean[c];
    const double share = static_cast<double>(kLuminanceWeights[c]) * white_balance[c] * patch.deviation[c];
    variance += share * share;
  }
  const double luminance = luminance_of(seen[0], seen[1], seen[2]);
  const double unit = luminance / (exposure.exposure_s * exposure.gain * exposure.vignetting);
  AbsoluteScale out;
  out.nits_per_unit = reading.nits / unit;
  out.deviation = out.nits_per_unit * std::hypot(reading.deviation, std::sqrt(variance) / luminance);
  return out;
}

}  // namespace lightwell::photometry
