#include "calibration/solve/photometry/picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <numeric>

#include <lightwell/color.hpp>
#include <lightwell/text.hpp>

#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

constexpr std::size_t kMaxCandidates = 40000;
/// Number of series, and of brightness classes, each of which contributes the same number of series.
constexpr std::size_t kSeries = 600, kShades = 20;
/// Side of the block of sites that a series averages: reduces noise and the effect of camera shake.
constexpr int kBlock = 3;
constexpr int kTiles = 4;
/// Decrease in a longer exposure, as a fraction of full scale, up to which it counts as noise.
constexpr double kMaxDecrease = 0.03;
/// Margin above saturation for single pixels of a block: noise may carry some above saturation while the mean is below,
/// and rejecting such blocks would bias the selection towards dark ones.
constexpr double kSaturationMargin = 0.015;

struct Candidate {
  PixelSeries series;
  double shade = 0;          ///< Mean over the exposures; increases with the light.
  double nonuniformity = 0;  ///< Largest difference inside the block, summed over the exposures.
  int tile = 0;
};

Candidate candidate_at(std::span<const Picture> pictures, int x, int y, int channel, double saturation) {
  Candidate out;
  out.series.channel = channel;
  for (const Picture& p : pictures) {
    double sum = 0, low = 1e9, high = -1e9;
    for (int j = 0; j < kBlock; ++j)
      for (int i = 0; i < kBlock; ++i) {
        const double v = static_cast<double>(p.at(x + i, y + j, channel));
        sum += v;
        low = std::min(low, v);
        high = std::max(high, v);
      }
    const bool saturated = high >= std::min(1.0, saturation + kSaturationMargin);
    const double mean = saturated ? std::max(high, 1.0) : sum / (kBlock * kBlock);
    out.series.values.push_back(mean);
    out.shade += std::clamp(mean, 0.0, 1.0) / static_cast<double>(pictures.size());
    out.nonuniformity += saturated ? 0 : high - low;
  }
  out.tile = x * kTiles / pictures.front().width + kTiles * (y * kTiles / pictures.front().height);
  return out;
}

bool rises(const PixelSeries& series, std::span<const std::size_t> order) {
  double highest = -1;
  for (const std::size_t j : order) {
    if (series.values[j] < highest - kMaxDecrease) return false;
    highest = std::max(highest, series.values[j]);
  }
  return true;
}

constexpr double kMinMean = 0.02, kMaxRelativeDeviation = 0.2, kMaxSaturatedFraction = 1e-3;
constexpr const char* kChannel[] = {"red", "green", "blue"};

bool positive(double v) { return v > 0 && std::isfinite(v); }

}  // namespace

Result<Picture> picture_of(const View& view, const std::string& name, int float_levels) {
  const PixelLayout& layout = pixel_layout(view.format);
  if (layout.sampling == ColorSampling::ycbcr)
    return invalid_argument(name + ": " + std::string(to_string(view.format)) +
                            " mixes the values of neighbours; record rgb8 or Bayer for a calibration");
  if (const Status s = check_view(view); !s.ok()) return invalid_argument(name + ": " + s.message());
  Picture out;
  out.pitch = layout.unit_width;
  out.width = view.width / out.pitch;
  out.height = view.height / out.pitch;
  out.levels = layout.is_float() ? float_levels : layout.levels();
  out.rgb.reserve(3 * out.sites());
  const double top = out.levels - 1;
  for (int y = 0; y < out.height; ++y) {
    if (is_bayer(view.format)) {
      for (int x = 0; x < out.width; ++x) {
        out.rgb.push_back(static_cast<float>(code_at(view, 2 * x, 2 * y) / top));
        out.rgb.push_back(static_cast<float>(code_at(view, 2 * x + 1, 2 * y) / top));
        out.rgb.push_back(static_cast<float>(code_at(view, 2 * x + 1, 2 * y + 1) / top));
      }
      continue;
    }
    const std::byte* row = view.data.data() + static_cast<std::size_t>(y) * view.stride;
    for (std::size_t k = 0; k < 3 * static_cast<std::size_t>(out.width); ++k) {
      if (!layout.is_float()) {
        out.rgb.push_back(static_cast<float>(std::to_integer<int>(row[k]) / top));
        continue;
      }
      float v;
      std::memcpy(&v, row + k * sizeof v, sizeof v);
      if (!std::isfinite(v)) return invalid_argument(name + ": a value is not finite; picture values run from 0 to 1");
      out.rgb.push_back(v);
    }
  }
  return out;
}

double rounding_deviation(int levels) { return levels > 1 ? 1 / (std::sqrt(12.0) * (levels - 1)) : 0; }

Status check_alike(std::span<const Picture> pictures, std::size_t least, const std::string& what) {
  if (pictures.size() < least)
    return invalid_argument(what + ": " + std::to_string(pictures.size()) + " pictures, at least " +
                            std::to_string(least) + " are needed; take more");
  for (const Picture& p : pictures) {
    const Picture& first = pictures.front();
    if (p.width != first.width || p.height != first.height || p.pitch != first.pitch || p.levels != first.levels)
      return invalid_argument(
          what + formatted(": pictures of %dx%d with %d levels and of %dx%d with %d; take all with one camera mode",
                           first.width, first.height, first.levels, p.width, p.height, p.levels));
    if (p.rgb.size() != 3 * p.sites() || p.sites() == 0) return invalid_argument(what + ": an empty picture");
  }
  return {};
}

Result<ResponseSamples> choose_samples(std::span<const Picture> pictures, std::span<const double> exposures,
                                       double dark_value, double saturation) {
  if (const Status s = check_alike(pictures, 3, "response"); !s.ok()) return s;
  if (exposures.size() != pictures.size())
    return invalid_argument(formatted("response: %zu exposures for %zu pictures", exposures.size(), pictures.size()));
  const Picture& first = pictures.front();
  std::vector<std::size_t> order(exposures.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return exposures[a] < exposures[b]; });

  int step = kBlock;
  while (static_cast<std::size_t>(first.width / step) * static_cast<std::size_t>(first.height / step) > kMaxCandidates)
    ++step;
  std::vector<Candidate> candidates;
  std::size_t moved = 0;
  for (int y = 0, row = 0; y + kBlock <= first.height; y += step, ++row)
    for (int x = 0, column = 0; x + kBlock <= first.width; x += step, ++column) {
      Candidate c = candidate_at(pictures, x, y, (row + column) % 3, saturation);
      if (rises(c.series, order))
        candidates.push_back(std::move(c));
      else
        ++moved;
    }
  if (candidates.size() < 20 || moved > candidates.size())
    return invalid_argument("response: " + std::to_string(moved) + " of " + std::to_string(moved + candidates.size()) +
                            " places get darker in a longer exposure, " + std::to_string(candidates.size()) +
                            " are left; keep camera and scene still, and check the exposures in the list");

  // Blocks that are dark or saturated in all exposures are not usable.
  const auto [low, high] = std::ranges::minmax_element(candidates, {}, &Candidate::shade);
  const double darkest = std::max(low->shade, dark_value + 1e-3), brightest = std::min(high->shade, saturation);
  std::vector<std::vector<const Candidate*>> shades(kShades);
  for (const Candidate& c : candidates) {
    if (c.shade < darkest || c.shade > brightest) continue;
    const double at = brightest > darkest ? (c.shade - darkest) / (brightest - darkest) * kShades : 0;
    shades[std::min(static_cast<std::size_t>(at), shades.size() - 1)].push_back(&c);
  }

  ResponseSamples out;
  out.exposures.assign(exposures.begin(), exposures.end());
  out.levels = first.levels;
  out.dark_value = dark_value;
  out.saturation = saturation;
  const std::size_t wanted = kSeries / kShades;
  for (auto& shade : shades) {
    std::ranges::stable_sort(shade, {}, &Candidate::nonuniformity);
    std::vector<std::size_t> in_tile(kTiles * kTiles);
    std::size_t taken = 0;
    // At most a quarter of the series from one of 16 regions of the picture.
    for (const Candidate* c : shade) {
      auto& count = in_tile[static_cast<std::size_t>(c->tile)];
      if (taken == wanted || count > wanted / 4) continue;
      out.pixels.push_back(c->series);
      ++count;
      ++taken;
    }
  }
  return out;
}

Result<PatchMean> patch_mean(const Picture& picture, const PatchRect& patch, const PhotometricCalibration& photometry,
                             const std::string& name) {
  const auto refused = [&](const std::string& what) { return invalid_argument(name + ": " + what); };
  const int pitch = picture.pitch;
  // 64 bits, because the patch is user input and may overflow 32.
  const std::int64_t right = std::int64_t{patch.x} + patch.width, below = std::int64_t{patch.y} + patch.height;
  if (patch.x < 0 || patch.y < 0 || patch.width < 1 || patch.height < 1 ||
      right > std::int64_t{picture.width} * pitch || below > std::int64_t{picture.height} * pitch)
    return refused(formatted("the patch %d,%d,%d,%d lies outside the picture of %dx%d pixels", patch.x, patch.y,
                             patch.width, patch.height, picture.width * pitch, picture.height * pitch));
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
      return invalid_argument(
          formatted("white balance: the chromaticity %f, %f is outside the gamut of Rec. 709", x, y));
  return rgb;
}

Result<WhiteBalance> solve_white_balance(const PatchMean& card, const std::array<double, 3>& illuminant) {
  for (std::size_t c = 0; c < 3; ++c)
    if (!(card.mean[c] > 0) || !std::isfinite(card.mean[c]) || !(illuminant[c] > 0) || !std::isfinite(illuminant[c]) ||
        !(card.deviation[c] >= 0))
      return invalid_argument("white balance: a channel of the card or of its light is not positive");
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
  if (!positive(nits)) return invalid_argument("absolute scale: the luminance must be positive, in cd/m²");
  if (!(deviation >= 0 && deviation < 1))
    return invalid_argument("absolute scale: the meter's relative deviation must be 0 to 1");
  return MeterReading{nits, deviation};
}

Result<MeterReading> illuminance_reading(double lux, double albedo, double deviation, double albedo_deviation) {
  if (!positive(lux)) return invalid_argument("absolute scale: the illuminance must be positive, in lux");
  if (!(albedo > 0 && albedo <= 1))
    return invalid_argument("absolute scale: the albedo must be above 0 and at most 1; a grey card's is 0.18");
  if (!(deviation >= 0 && deviation < 1) || !(albedo_deviation >= 0 && albedo_deviation < 1))
    return invalid_argument("absolute scale: the relative deviations of meter and albedo must be 0 to 1");
  return MeterReading{lux * albedo / std::numbers::pi, std::hypot(deviation, albedo_deviation)};
}

Result<AbsoluteScale> solve_absolute_scale(const PatchMean& patch, const std::array<double, 3>& white_balance,
                                           const PatchExposure& exposure, const MeterReading& reading) {
  if (!positive(reading.nits) || !(reading.deviation >= 0))
    return invalid_argument("absolute scale: the reading must be positive");
  if (!positive(exposure.exposure_s) || !positive(exposure.gain))
    return invalid_argument("absolute scale: exposure and gain of the patch's picture must be given and positive");
  if (!(exposure.vignetting >= 0.05))
    return invalid_argument(
        "absolute scale: the vignetting at the patch is too strong; put the patch into the middle of the picture");
  std::array<double, 3> seen{};
  double variance = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!positive(patch.mean[c]) || !positive(white_balance[c]))
      return invalid_argument("absolute scale: a channel of the patch is not positive");
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
