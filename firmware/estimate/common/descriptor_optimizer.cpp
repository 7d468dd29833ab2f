#include "estimate/common/descriptor_optimizer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <lightwell/cap.hpp>

namespace lightwell::estimate {
namespace {

constexpr std::size_t kChosenCoefficients = sh_count(kMaxBand);
constexpr double kSphere = 4 * std::numbers::pi;

/// Share of the limit that a prediction may reach: the truncation is exact but for the bands above 12, the other errors
/// are expected values.
constexpr double kLimitMargin = 0.9;
/// A poorer choice than the last one is taken where it reaches at most this share of the limit.
constexpr double kHysteresis = 0.8;
/// Share of the limit that rounding may take. In quadrature it costs a hundredth of that.
constexpr double kRoundingShare = 0.3;
/// Bytes of a light, and of what else there is in a message (see proto/README.md, caps and sizes).
constexpr double kLightBytes = 32, kOtherBytes = 64;
/// Where nothing keeps the limit, errors that differ by less are alike.
constexpr double kClearlyLess = 0.98;
/// A light that was sent before counts for so much more: two that are alike must not take turns.
constexpr double kTrackHysteresis = 0.8;

/// What a zigzag varint of a rounded number takes.
double varint_bytes(double value, double inverse_step) {
  const double m = std::abs(value) * inverse_step;
  return m < 63.5 ? 1 : m < 8191.5 ? 2 : 3;
}

/// By how much the bands up to `band` may be rounded.
double allowed_step(int band, bool all_bands, double allowed_rms) {
  double sum = 0;
  for (int l = 0; l <= band; ++l)
    if (all_bands || cosine_lobe(l) != 0)
      sum += (2 * l + 1) * std::max(cosine_lobe(l) * cosine_lobe(l), all_bands ? 0.1 : 0.0);
  // Rounding by a step q has the variance q²/12 in every coefficient.
  return allowed_rms / std::sqrt(sum / kSphere / 12);
}

/// The largest power of two that is no larger.
int exponent_within(double step) {
  return step > 0 && std::isfinite(step) ? std::clamp(static_cast<int>(std::floor(std::log2(step))), -140, 100) : -140;
}

/// The error of irradiance that is to be expected, by its limit.
double excess_of(double truncation, const OptimizerOptions& limits) {
  return std::hypot(truncation, limits.independent_error, kRoundingShare / 2 * limits.epsilon) / (kLimitMargin * limits.epsilon);
}

bool needs_all_bands(const OptimizerOptions& limits) { return limits.radiance_epsilon > 0 || !(limits.epsilon > 0); }

}  // namespace

DescriptorOptimizer::DescriptorOptimizer() : shapes_(kMaxLights), residuals_(kMaxLights + 1) {
  order_.reserve(kMaxLights);
  previous_tracks_.reserve(kMaxLights);
  (void)band_weights();
}

bool DescriptorOptimizer::was_selected(std::uint32_t track) const {
  return std::find(previous_tracks_.begin(), previous_tracks_.end(), track) != previous_tracks_.end();
}

void DescriptorOptimizer::subtract(const Light& light, const Shape& shape, ResidualSh& rest) const {
  for (int k = 0; k < 3; ++k) {
    const float e = light.irradiance[k];
    float* __restrict c = rest.c[k];
    for (std::size_t i = 0; i < kRowCount; ++i) c[i] -= e * shape.y[i];
  }
}

double DescriptorOptimizer::residual_energy_above_band2(const ResidualSh& rest, const Light& light, const Shape& shape,
                               const float (&inverse_whole)[3]) const {
  // Bands 0 to 2 cost few bytes and hold nine tenths of what irradiance feels: a light is worth what it takes from the
  // others.
  const BandWeights& w = band_weights();
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const float e = light.irradiance[k];
    const float* __restrict c = rest.c[k];
    float part = 0;
    for (std::size_t i = sh_count(2); i < kRowCount; ++i) {
      const float left = c[i] - e * shape.y[i];
      part += w.irradiance[i] * left * left;
    }
    sum += static_cast<double>(part * inverse_whole[k]);
  }
  return sum;
}

void DescriptorOptimizer::order_lights(std::span<const Light> found, int required, std::size_t most, const float (&inverse_whole)[3]) {
  order_.clear();
  const std::size_t considered = std::min(found.size(), kMaxConsidered);
  Light none;
  for (std::size_t step = 0; step < most && step < considered; ++step) {
    std::size_t best = considered;
    double least = std::numeric_limits<double>::infinity();
    if (step == 0 && required >= 0) {
      best = static_cast<std::size_t>(required);
    } else {
      const double now = residual_energy_above_band2(residuals_[step], none, shapes_[0], inverse_whole);
      for (std::size_t j = 0; j < considered; ++j) {
        if (std::find(order_.begin(), order_.end(), j) != order_.end()) continue;
        double gain = now - residual_energy_above_band2(residuals_[step], found[j], shapes_[j], inverse_whole);
        if (was_selected(found[j].track)) gain /= kTrackHysteresis;
        if (-gain < least) {
          least = -gain;
          best = j;
        }
      }
      if (best == considered || !(least < 0)) break;
    }
    order_.push_back(best);
    residuals_[step + 1] = residuals_[step];
    subtract(found[best], shapes_[best], residuals_[step + 1]);
  }
}

void DescriptorOptimizer::truncation_energy(const ResidualSh& rest, bool all_bands, double (&irradiance)[kBands][3],
                         double (&radiance)[kBands][3]) const {
  const BandWeights& w = band_weights();
  double e[3][kTailBands.back() + 1] = {}, l2[3][kTailBands.back() + 1] = {};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < kRowCount; ++i) {
      const double c2 = static_cast<double>(rest.c[k][i]) * rest.c[k][i];
      e[k][w.band[i]] += w.irradiance[i] * c2;
      l2[k][w.band[i]] += w.radiance[i] * c2;
    }
    double e_tail = 0, l_tail = 0;
    for (const int l : kTailBands) {
      e_tail += e[k][l];
      l_tail += l2[k][l];
    }
    e_tail *= 1 + w.above_irradiance;
    for (int band = kMaxBand; band >= 0; --band) {
      // Bands without irradiance are not sent where it alone counts.
      double skipped = 0;
      if (!all_bands)
        for (int l = 3; l < band; l += 2) skipped += l2[k][l];
      irradiance[band][k] = e_tail;
      radiance[band][k] = l_tail + skipped;
      e_tail += e[k][band];
      l_tail += l2[k][band];
    }
  }
}

DescriptorOptimizer::ReferenceRms DescriptorOptimizer::begin(const Projection& scene) {
  const BandWeights& w = band_weights();
  double irradiance2[3] = {}, radiance2[3] = {};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < kRowCount; ++i) {
      residuals_[0].c[k][i] = static_cast<float>(scene.c[i][k]);
      irradiance2[k] += w.irradiance[i] * scene.c[i][k] * scene.c[i][k];
      radiance2[k] += w.radiance[i] * scene.c[i][k] * scene.c[i][k];
    }
  }
  return {rms(irradiance2), rms(radiance2)};
}

void DescriptorOptimizer::shape_of(const Light& light, Shape& out) {
  const BandWeights& w = band_weights();
  const BasisRow y = basis_row(vec_cast<double>(light.direction));
  float zonal[kTailBands.back() + 1];
  for (int l = 0; l <= kTailBands.back(); ++l) zonal[l] = static_cast<float>(cap_zonal(l, light.angular_radius_rad));
  for (std::size_t i = 0; i < kRowCount; ++i) out.y[i] = zonal[w.band[i]] * y[i];
}

template <class Visit>
void DescriptorOptimizer::for_bands(std::size_t lights, const OptimizerOptions& limits, const ReferenceRms& whole, Visit&& visit) const {
  const bool all_bands = needs_all_bands(limits);
  // The step will be a power of two between all and half of that. To reckon with the one it will be would choose
  // otherwise for a scene that is the same but brighter.
  const double step = allowed_step(limits.band, all_bands, kRoundingShare * limits.epsilon * whole.irradiance.plain);
  const double inverse_step = step > 0 ? std::numbers::sqrt2 / step : 0;
  double irradiance_lost[kBands][3], radiance_lost[kBands][3];
  truncation_energy(residuals_[lights], all_bands, irradiance_lost, radiance_lost);
  Configuration o;
  o.lights = lights;
  o.bytes = kOtherBytes + kLightBytes * static_cast<double>(lights);
  for (int l = 0; l <= limits.band; ++l) {
    if (!all_bands && l > 1 && l % 2 != 0) continue;
    for (std::size_t i = static_cast<std::size_t>(l * l); i < static_cast<std::size_t>(sh_count(l)); ++i)
      for (std::size_t k = 0; k < 3; ++k) o.bytes += varint_bytes(residuals_[lights].c[k][i], inverse_step);
    o.band = l;
    const double truncation = relative(rms(irradiance_lost[l]), whole.irradiance);
    o.excess = excess_of(truncation, limits);
    if (limits.radiance_epsilon > 0)
      o.excess =
          std::max(o.excess, relative(rms(radiance_lost[l]), whole.radiance) / (kLimitMargin * limits.radiance_epsilon));
    visit(o);
  }
}

int DescriptorOptimizer::max_lights_to_find(const Projection& scene, const Light* brightest, const OptimizerOptions& limits) {
  if (!(limits.epsilon > 0)) return limits.max_lights;
  const ReferenceRms whole = begin(scene);
  // What has other causes no light makes better.
  const double good_enough = std::max(kHysteresis, excess_of(0, limits) / kClearlyLess);
  double bytes = std::numeric_limits<double>::infinity();
  const auto look = [&](const Configuration& o) {
    if (o.excess <= good_enough) bytes = std::min(bytes, o.bytes);
  };
  for_bands(0, limits, whole, look);
  if (brightest != nullptr) {
    shape_of(*brightest, shapes_[0]);
    residuals_[1] = residuals_[0];
    subtract(*brightest, shapes_[0], residuals_[1]);
    for_bands(1, limits, whole, look);
  }
  if (!std::isfinite(bytes)) return limits.max_lights;
  const int paying = static_cast<int>((bytes - kOtherBytes) / kLightBytes),
            kept = static_cast<int>(previous_tracks_.size());
  return std::min(limits.max_lights, paying > 0 ? std::max(paying, kept) + 1 : std::max(kept, 1));
}

void DescriptorOptimizer::optimize(const Projection& scene, std::span<const Light> found, int required, const OptimizerOptions& limits,
                     std::vector<Light>& kept, OptimizedDescriptor& out) {
  const BandWeights& w = band_weights();
  const bool all_bands = needs_all_bands(limits);
  const auto most = std::min<std::size_t>(static_cast<std::size_t>(limits.max_lights), found.size());
  const ReferenceRms whole = begin(scene);
  out.whole = whole.irradiance;
  const std::size_t shaped = std::min(found.size(), limits.epsilon > 0 ? kMaxConsidered : most);
  for (std::size_t j = 0; j < shaped; ++j) shape_of(found[j], shapes_[j]);
  if (required >= static_cast<int>(shaped))
    shape_of(found[static_cast<std::size_t>(required)], shapes_[static_cast<std::size_t>(required)]);

  std::size_t lights = 0;
  int band = limits.band;
  if (limits.epsilon > 0) {
    // Relative to the whole, over all channels as errors are counted.
    const auto inverse = static_cast<float>(out.whole.plain > 0 ? 1 / (out.whole.plain * out.whole.plain) : 0);
    order_lights(found, required, most, {inverse, inverse, inverse});
    Configuration best, fallback;
    best.bytes = fallback.excess = std::numeric_limits<double>::infinity();
    for (std::size_t n = required >= 0 && !order_.empty() ? 1 : 0; n <= order_.size(); ++n) {
      if (kOtherBytes + kLightBytes * static_cast<double>(n) > best.bytes) break;
      bool same_lights = n == previous_tracks_.size();
      for (std::size_t j = 0; j < n && same_lights; ++j) same_lights = was_selected(found[order_[j]].track);
      for_bands(n, limits, whole, [&](const Configuration& o) {
        if (o.excess < kClearlyLess * fallback.excess) fallback = o;
        const bool poorer = n < previous_tracks_.size() || o.band < previous_band_;
        if (o.excess > (poorer ? kHysteresis : 1.0)) return;
        // What was sent before is left only for a fair gain.
        const double price = same_lights && o.band == previous_band_ ? 0.93 * o.bytes : o.bytes;
        if (price < best.bytes) {
          best = o;
          best.bytes = price;
        }
      });
    }
    const Configuration& taken = std::isfinite(best.bytes) ? best : fallback;
    lights = taken.lights;
    band = taken.band;
  } else {
    order_.clear();
    for (std::size_t j = 0; j < shaped; ++j) {
      order_.push_back(j);
      residuals_[j + 1] = residuals_[j];
      subtract(found[j], shapes_[j], residuals_[j + 1]);
    }
    lights = shaped;
  }

  const ResidualSh& rest = residuals_[lights];
  double irradiance_lost[kBands][3], radiance_lost[kBands][3];
  truncation_energy(rest, all_bands, irradiance_lost, radiance_lost);
  out.truncation = rms(irradiance_lost[band]);
  out.step =
      limits.epsilon > 0 && out.whole.plain > 0
          ? std::ldexp(
                1.0F, exponent_within(allowed_step(band, all_bands, kRoundingShare * limits.epsilon * out.whole.plain)))
          : 0.0F;
  out.rest = {};
  out.rest.band = band;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sh_count(band)); ++i)
    if (all_bands || w.irradiance[i] != 0)
      for (std::size_t k = 0; k < 3; ++k) out.rest.c[i][static_cast<int>(k)] = rest.c[k][i];

  kept.clear();
  for (std::size_t j = 0; j < found.size(); ++j)
    if (std::find(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(lights), j) !=
        order_.begin() + static_cast<std::ptrdiff_t>(lights))
      kept.push_back(found[j]);
  previous_tracks_.clear();
  for (const Light& light : kept) previous_tracks_.push_back(light.track);
  previous_band_ = band;
}

}  // namespace lightwell::estimate
