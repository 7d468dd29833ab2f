#include "calibration/solve/photometry/patch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <lightwell/color.hpp>

#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

constexpr double kMinMean = 0.02, kMaxRelativeDeviation = 0.2, kMaxSaturatedFraction = 1e-3;
constexpr const char* kChannel[] = {"red", "green", "blue"};

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, what}; }
bool positive(double v) { return v > 0 && std::isfinite(v); }

}  // namespace

Result<PatchMean> patch_mean(const Picture& picture, const PatchRect& patch, const PhotometricCalibration& photometry,
                             const std::string& name) {
  const auto refused = [&](const std::string& what) { return invalid(name + ": " + what); };
  const int pitch = picture.pitch;
  // 64 bits, because the patch is user input and may overflow 32.
  const std::int64_t right = std::int64_t{patch.x} + patch.width, below = std::int64_t{patch.y} + patch.height;
  if (patch.x < 0 || patch.y < 0 || patch.width < 1 || patch.height < 1 ||
      right > std::int64_t{picture.width} * pitch || below > std::int64_t{picture.height} * pitch)
    return refused("the patch " + std::to_string(patch.x) + "," + std::to_string(patch.y) + "," +
                   std::to_string(patch.width) + "," + std::to_string(patch.height) + " lies outside the picture of " +
                   std::to_string(picture.width * pitch) + "x" + std::to_string(picture.height * pitch) + " pixels");
  const int x0 = (patch.x + pitch - 1) / pitch, x1 = static_cast<int>(right) / pitch;
  const int y0 = (patch.y + pitch - 1) / pitch, y1 = static_cast<int>(below) / pitch;
  if (x1 <= x0 || y1 <= y0 || (x1 - x0) * (y1 - y0) < 16)
    return refused("the patch has fewer than 16 sites; choose a larger one");

  PatchMean out;
  out.count = static_cast<double>(x1 - x0) * (y1 - y0);
  for (int c = 0; c < 3; ++c) {
    std::vector<double> values;
    double saturated = 0;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        const double v = static_cast<double>(picture.at(x, y, c));
        saturated += v >= photometry.saturation ? 1 : 0;
        values.push_back(linear_value(photometry, v));
      }
    const std::string channel = kChannel[c];
    if (saturated > kMaxSaturatedFraction * out.count)
      return refused("the patch is saturated in " + channel + "; take it with a shorter exposure");
    const double rounding = rounding_deviation(picture.levels);
    const auto [mean, variance, deviation, count] = clipped_mean(values, 2 * rounding, rounding, 4);
    if (!(mean > kMinMean))
      return refused("the patch is too dark in " + channel + " (" + std::to_string(mean) +
                     " of full scale); take it with a longer exposure");
    if (deviation > kMaxRelativeDeviation * mean || count < 0.9 * out.count)
      return refused("the patch is not even in " + channel +
                     "; choose one that lies inside the card, without a shadow");
    out.mean[static_cast<std::size_t>(c)] = mean;
    out.deviation[static_cast<std::size_t>(c)] = deviation / std::sqrt(count);
  }
  return out;
}

Result<std::array<double, 3>> rgb_of_chromaticity(double x, double y) {
  // XYZ to linear RGB, IEC 61966-2-1, 5.2.
  const double xn = x / y, zn = (1 - x - y) / y;
  const std::array<double, 3> rgb{3.2406255 * xn - 1.5372080 - 0.4986286 * zn,
                                  -0.9689307 * xn + 1.8757561 + 0.0415175 * zn,
                                  0.0557101 * xn - 0.2040211 + 1.0569959 * zn};
  for (const double c : rgb)
    if (!(c > 0.01) || !std::isfinite(c))
      return invalid("white balance: the chromaticity " + std::to_string(x) + ", " + std::to_string(y) +
                     " is outside the gamut of Rec. 709");
  return rgb;
}

Result<WhiteBalance> solve_white_balance(const PatchMean& card, const std::array<double, 3>& illuminant) {
  for (std::size_t c = 0; c < 3; ++c)
    if (!(card.mean[c] > 0) || !std::isfinite(card.mean[c]) || !(illuminant[c] > 0) || !std::isfinite(illuminant[c]) ||
        !(card.deviation[c] >= 0))
      return invalid("white balance: a channel of the card or of its light is not positive");
  WhiteBalance out;
  const double green = card.deviation[1] / card.mean[1];
  std::array<double, 3> own{};
  for (std::size_t c = 0; c < 3; ++c) {
    out.factors[c] = c == 1 ? 1 : card.mean[1] / card.mean[c] * illuminant[c] / illuminant[1];
    own[c] = card.deviation[c] / card.mean[c];
  }
  const double red = out.factors[0], blue = out.factors[2];
  out.covariance = {red * red * (own[0] * own[0] + green * green), red * blue * green * green,
                    red * blue * green * green, blue * blue * (own[2] * own[2] + green * green)};
  return out;
}

Result<MeterReading> luminance_reading(double nits, double deviation) {
  if (!positive(nits)) return invalid("absolute scale: the luminance must be positive, in cd/m²");
  if (!(deviation >= 0 && deviation < 1))
    return invalid("absolute scale: the meter's relative deviation must be 0 to 1");
  return MeterReading{nits, deviation};
}

Result<MeterReading> illuminance_reading(double lux, double albedo, double deviation, double albedo_deviation) {
  if (!positive(lux)) return invalid("absolute scale: the illuminance must be positive, in lux");
  if (!(albedo > 0 && albedo <= 1))
    return invalid("absolute scale: the albedo must be above 0 and at most 1; a grey card's is 0.18");
  if (!(deviation >= 0 && deviation < 1) || !(albedo_deviation >= 0 && albedo_deviation < 1))
    return invalid("absolute scale: the relative deviations of meter and albedo must be 0 to 1");
  return MeterReading{lux * albedo / std::numbers::pi, std::hypot(deviation, albedo_deviation)};
}

Result<AbsoluteScale> solve_absolute_scale(const PatchMean& patch, const std::array<double, 3>& white_balance,
                                           const PatchExposure& exposure, const MeterReading& reading) {
  if (!positive(reading.nits) || !(reading.deviation >= 0))
    return invalid("absolute scale: the reading must be positive");
  if (!positive(exposure.exposure_s) || !positive(exposure.gain))
    return invalid("absolute scale: exposure and gain of the patch's picture must be given and positive");
  if (!(exposure.vignetting >= 0.05))
    return invalid(
        "absolute scale: the vignetting at the patch is too strong; put the patch into the middle of the picture");
  std::array<double, 3> seen{};
  double variance = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!positive(patch.mean[c]) || !positive(white_balance[c]))
      return invalid("absolute scale: a channel of the patch is not positive");
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
