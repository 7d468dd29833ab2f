#include "estimate/common/descriptor_optimizer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <lightwell/cap.hpp>
#include <lightwell/wire_size.hpp>

namespace lightwell::estimate {
namespace {

/// Share of the limit that a prediction may reach. Truncation is exact up to band 12; other errors are expectations.
constexpr double kLimitMargin = 0.9;
/// A selection with fewer lights or bands than the previous one may reach this share of the limit.
constexpr double kHysteresis = 0.8;
/// Share of the limit that rounding may use; in quadrature it adds at most a twentieth to the error.
constexpr double kRoundingShare = 0.3;
/// Bytes of a light, and of the message without lights and coefficients (see proto/README.md, caps and sizes).
constexpr double kLightBytes = 32, kOtherBytes = 64;
/// Where no configuration is within the limit, one replaces another only if its error is below this share.
constexpr double kDecisiveRatio = 0.98;
/// The previous selection counts as 7 % cheaper: its bytes, or where these are limited its error.
constexpr double kPreviousPrice = 0.93;
/// The gain of a light that was sent before is divided by this, so that two similar lights do not alternate.
constexpr double kTrackHysteresis = 0.8;

/// Bytes of the zigzag varint of a rounded coefficient.
double varint_bytes(double value, double inverse_step) {
  const double m = std::abs(value) * inverse_step;
  return m < 63.5 ? 1 : m < 8191.5 ? 2 : 3;
}

/// Quantization step of the bands up to `band` that causes an RMS error of irradiance of `allowed_rms`.
double allowed_step(int band, bool all_bands, double allowed_rms) {
  double sum = 0;
  for (int l = 0; l <= band; ++l)
    if (all_bands || cosine_lobe(l) != 0)
      sum += (2 * l + 1) * std::max(cosine_lobe(l) * cosine_lobe(l), all_bands ? 0.1 : 0.0);
  // Rounding with step q has a variance of q²/12 in each coefficient.
  return allowed_rms / std::sqrt(sum / kSphere / 12);
}

/// Exponent of the largest power of two that is at most `step`.
int exponent_within(double step) {
  return step > 0 && std::isfinite(step) ? std::clamp(static_cast<int>(std::floor(std::log2(step))), -140, 100) : -140;
}

/// The finest step gives mantissas of at most 12 bits, 2^6 of these steps one byte. A coarser one saves bytes only by
/// leaving bands out, which loses less where it is chosen.
constexpr int kFinestBits = 12, kMaxCoarsening = 7;

/// Exponent of the step with which the largest coefficient of the bands up to `band` has kFinestBits; 0 for zero.
int finest_exponent(const std::array<BasisRow, 3>& coefficients, int band) {
  float largest = 0;
  for (const BasisRow& c : coefficients)
    for (std::size_t i = 0; i < static_cast<std::size_t>(sh_count(band)); ++i)
      largest = std::max(largest, std::abs(c[i]));
  int k = 0;
  (void)std::frexp(largest, &k);  // Below 2^k.
  return largest > 0 && std::isfinite(largest) ? std::clamp(k - kFinestBits, -149, 100) : 0;
}

/// The rounding of one band to a step.
struct RoundedBand {
  std::size_t bytes = 0;  ///< Of its mantissas; 0 if all are zero.
  double lost[3] = {};    ///< Sum of squared rounding errors, by channel.
};

RoundedBand round_band(const std::array<BasisRow, 3>& coefficients, int band, double step) {
  RoundedBand out;
  bool zero = true;
  for (std::size_t i = static_cast<std::size_t>(band * band); i < static_cast<std::size_t>(sh_count(band)); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const double mantissa = std::nearbyint(coefficients[k][i] / step);
      const double error = coefficients[k][i] - mantissa * step;
      zero &= mantissa == 0;
      out.bytes += mantissa_bytes(static_cast<std::int32_t>(mantissa));
      out.lost[k] += error * error;
    }
  // Band 0 is always sent.
  if (zero && band > 0) out.bytes = 0;
  return out;
}

bool is_sent(int band, bool all_bands) { return all_bands || cosine_lobe(band) != 0; }

/// Expected error of irradiance, relative to its limit.
double error_ratio(double truncation, const OptimizerOptions& limits) {
  return std::hypot(truncation, limits.independent_error, kRoundingShare / 2 * limits.epsilon) /
         (kLimitMargin * limits.epsilon);
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

bool DescriptorOptimizer::were_selected(std::span<const Light> candidates, std::size_t count) const {
  if (count != previous_tracks_.size()) return false;
  for (std::size_t j = 0; j < count; ++j)
    if (!was_selected(candidates[order_[j]].track)) return false;
  return true;
}

void DescriptorOptimizer::subtract(const Light& light, const BasisRow& shape, ResidualSh& residual) const {
  for (int k = 0; k < 3; ++k) {
    const float e = light.irradiance[k];
    float* __restrict c = residual[static_cast<std::size_t>(k)].data();
    for (std::size_t i = 0; i < kRowCount; ++i) c[i] -= e * shape[i];
  }
}

double DescriptorOptimizer::residual_energy_above_band2(const ResidualSh& residual, const Light& light,
                                                        const BasisRow& shape, float inverse_mean_square) const {
  // Bands 0 to 2 cost few bytes and contain nine tenths of the irradiance; a light is valued by the other bands.
  const BandWeights& w = band_weights();
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const float e = light.irradiance[k];
    const float* __restrict c = residual[static_cast<std::size_t>(k)].data();
    float part = 0;
    for (std::size_t i = sh_count(2); i < kRowCount; ++i) {
      const float residual_coefficient = c[i] - e * shape[i];
      part += w.irradiance[i] * residual_coefficient * residual_coefficient;
    }
    sum += static_cast<double>(part * inverse_mean_square);
  }
  return sum;
}

void DescriptorOptimizer::order_lights(std::span<const Light> candidates, int required, std::size_t most,
                                       float inverse_mean_square) {
  order_.clear();
  const std::size_t considered = std::min(candidates.size(), kMaxConsidered);
  Light none;
  for (std::size_t step = 0; step < most && step < considered; ++step) {
    std::size_t best = considered;
    double least = std::numeric_limits<double>::infinity();
    if (step == 0 && required >= 0) {
      best = static_cast<std::size_t>(required);
    } else {
      const double now = residual_energy_above_band2(residuals_[step], none, shapes_[0], inverse_mean_square);
      for (std::size_t j = 0; j < considered; ++j) {
        if (std::find(order_.begin(), order_.end(), j) != order_.end()) continue;
        double gain =
            now - residual_energy_above_band2(residuals_[step], candidates[j], shapes_[j], inverse_mean_square);
        if (was_selected(candidates[j].track)) gain /= kTrackHysteresis;
        if (-gain < least) {
          least = -gain;
          best = j;
        }
      }
      if (best == considered || !(least < 0)) break;
    }
    order_.push_back(best);
    residuals_[step + 1] = residuals_[step];
    subtract(candidates[best], shapes_[best], residuals_[step + 1]);
  }
}

void DescriptorOptimizer::truncation_energy(const ResidualSh& residual, bool all_bands, double (&irradiance)[kBands][3],
                                            double (&radiance)[kBands][3]) const {
  const BandWeights& w = band_weights();
  double e[3][kTailBands.back() + 1] = {}, l2[3][kTailBands.back() + 1] = {};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < kRowCount; ++i) {
      const double c2 = static_cast<double>(residual[k][i]) * residual[k][i];
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
      // Bands without irradiance are not sent where only irradiance is limited.
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
      residuals_[0][k][i] = static_cast<float>(scene.c[i][k]);
      irradiance2[k] += w.irradiance[i] * scene.c[i][k] * scene.c[i][k];
      radiance2[k] += w.radiance[i] * scene.c[i][k] * scene.c[i][k];
    }
  }
  return {rms(irradiance2), rms(radiance2)};
}

BasisRow DescriptorOptimizer::shape_of(const Light& light) {
  const BandWeights& w = band_weights();
  BasisRow out = basis_row(vec_cast<double>(light.direction));
  float zonal[kTailBands.back() + 1];
  for (int l = 0; l <= kTailBands.back(); ++l) zonal[l] = static_cast<float>(cap_zonal(l, light.angular_radius_rad));
  for (std::size_t i = 0; i < kRowCount; ++i) out[i] = zonal[w.band[i]] * out[i];
  return out;
}

template <class Visit>
void DescriptorOptimizer::for_each_band(std::size_t lights, const OptimizerOptions& limits,
                                        const ReferenceRms& reference, Visit&& visit) const {
  const bool all_bands = needs_all_bands(limits);
  // The step will be rounded down to a power of two: with its geometric mean the scene's brightness has no effect.
  const double step =
      allowed_step(limits.band, all_bands, kRoundingShare * limits.epsilon * reference.irradiance.plain);
  const double inverse_step = step > 0 ? std::numbers::sqrt2 / step : 0;
  double lost_irradiance[kBands][3], lost_radiance[kBands][3];
  truncation_energy(residuals_[lights], all_bands, lost_irradiance, lost_radiance);
  Configuration configuration;
  configuration.lights = lights;
  configuration.bytes = kOtherBytes + kLightBytes * static_cast<double>(lights);
  for (int l = 0; l <= limits.band; ++l) {
    if (!all_bands && l > 1 && l % 2 != 0) continue;
    for (std::size_t i = static_cast<std::size_t>(l * l); i < static_cast<std::size_t>(sh_count(l)); ++i)
      for (std::size_t k = 0; k < 3; ++k) configuration.bytes += varint_bytes(residuals_[lights][k][i], inverse_step);
    configuration.band = l;
    const double truncation = relative(rms(lost_irradiance[l]), reference.irradiance);
    configuration.error_ratio = error_ratio(truncation, limits);
    if (limits.radiance_epsilon > 0)
      configuration.error_ratio =
          std::max(configuration.error_ratio,
                   relative(rms(lost_radiance[l]), reference.radiance) / (kLimitMargin * limits.radiance_epsilon));
    visit(configuration);
  }
}

int DescriptorOptimizer::max_lights_to_find(const Projection& scene, const Light* brightest,
                                            const OptimizerOptions& limits) {
  const int most =
      limits.max_bytes > 0
          ? static_cast<int>(std::min(static_cast<std::size_t>(limits.max_lights),
                                      std::max<std::size_t>(1, limits.max_bytes / max_light_bytes(Light{}))))
          : limits.max_lights;
  if (!(limits.epsilon > 0)) return most;
  const ReferenceRms reference = begin(scene);
  // Lights do not reduce errors that have other causes.
  const double good_enough = std::max(kHysteresis, error_ratio(0, limits) / kDecisiveRatio);
  double bytes = std::numeric_limits<double>::infinity();
  const auto update_bytes = [&](const Configuration& c) {
    if (c.error_ratio <= good_enough) bytes = std::min(bytes, c.bytes);
  };
  for_each_band(0, limits, reference, update_bytes);
  if (brightest != nullptr) {
    shapes_[0] = shape_of(*brightest);
    residuals_[1] = residuals_[0];
    subtract(*brightest, shapes_[0], residuals_[1]);
    for_each_band(1, limits, reference, update_bytes);
  }
  if (!std::isfinite(bytes)) return most;
  const int worthwhile = static_cast<int>((bytes - kOtherBytes) / kLightBytes),
            selected = static_cast<int>(previous_tracks_.size());
  return std::min(most, worthwhile > 0 ? std::max(worthwhile, selected) + 1 : std::max(selected, 1));
}

DescriptorOptimizer::Configuration DescriptorOptimizer::fewest_bytes(std::span<const Light> candidates, int required,
                                                                     const OptimizerOptions& limits,
                                                                     const ReferenceRms& reference) const {
  Configuration best, fallback;
  best.bytes = fallback.error_ratio = std::numeric_limits<double>::infinity();
  for (std::size_t n = required >= 0 && !order_.empty() ? 1 : 0; n <= order_.size(); ++n) {
    if (kOtherBytes + kLightBytes * static_cast<double>(n) > best.bytes) break;
    const bool same_lights = were_selected(candidates, n);
    for_each_band(n, limits, reference, [&](const Configuration& c) {
      if (c.error_ratio < kDecisiveRatio * fallback.error_ratio) fallback = c;
      const bool reduced = n < previous_tracks_.size() || c.band < previous_band_;
      if (c.error_ratio > (reduced ? kHysteresis : 1.0)) return;
      const double price = same_lights && c.band == previous_band_ ? kPreviousPrice * c.bytes : c.bytes;
      if (price < best.bytes) {
        best = c;
        best.bytes = price;
      }
    });
  }
  Configuration chosen = std::isfinite(best.bytes) ? best : fallback;
  if (reference.irradiance.plain > 0)
    chosen.step =
        std::ldexp(1.0F, exponent_within(allowed_step(chosen.band, needs_all_bands(limits),
                                                      kRoundingShare * limits.epsilon * reference.irradiance.plain)));
  return chosen;
}

DescriptorOptimizer::Configuration DescriptorOptimizer::least_error(std::span<const Light> candidates,
                                                                    const OptimizerOptions& limits,
                                                                    const ReferenceRms& reference) const {
  const BandWeights& w = band_weights();
  const bool all_bands = limits.radiance_epsilon > 0;
  // Where only one of two errors has a limit, both are relative to it.
  const double radiance_limit = limits.radiance_epsilon, limit = limits.epsilon > 0   ? limits.epsilon
                                                                 : radiance_limit > 0 ? radiance_limit
                                                                                      : 1;
  Configuration best;
  double least = std::numeric_limits<double>::infinity();
  bool chosen = false;
  std::size_t light_bytes = 0;
  for (std::size_t n = 0; n <= order_.size(); ++n) {
    if (n > 0) light_bytes += max_light_bytes(candidates[order_[n - 1]]);
    if (light_bytes + kMaxBand0Bytes > limits.max_bytes) break;
    const ResidualSh& residual = residuals_[n];
    const bool same_lights = were_selected(candidates, n);
    double lost_irradiance[kBands][3], lost_radiance[kBands][3];
    truncation_energy(residual, all_bands, lost_irradiance, lost_radiance);
    const int finest = finest_exponent(residual, limits.band);
    for (int exponent = finest; exponent <= finest + kMaxCoarsening; ++exponent) {
      const double step = std::ldexp(1.0, exponent);
      std::size_t mantissas = 0;
      double rounded_irradiance[3] = {}, rounded_radiance[3] = {};
      for (int l = 0; l <= limits.band; ++l) {
        if (!is_sent(l, all_bands)) continue;
        const RoundedBand band = round_band(residual, l, step);
        mantissas += band.bytes;
        if (light_bytes + max_radiance_bytes(mantissas, exponent) > limits.max_bytes) break;
        double irradiance[3], radiance[3];
        for (std::size_t k = 0; k < 3; ++k) {
          rounded_irradiance[k] += w.irradiance[l * l] * band.lost[k];
          rounded_radiance[k] += w.radiance[l * l] * band.lost[k];
          irradiance[k] = lost_irradiance[l][k] + rounded_irradiance[k];
          radiance[k] = lost_radiance[l][k] + rounded_radiance[k];
        }
        double error = std::hypot(relative(rms(irradiance), reference.irradiance), limits.independent_error) / limit;
        if (radiance_limit > 0) error = std::max(error, relative(rms(radiance), reference.radiance) / radiance_limit);
        const double price = same_lights && l == previous_band_ ? kPreviousPrice * error : error;
        if (chosen && !(price < least)) continue;
        chosen = true;
        least = price;
        best = {n, l, 0, error, static_cast<float>(step)};
      }
    }
  }
  return best;
}

std::size_t DescriptorOptimizer::wire_bytes(std::span<const Light> candidates, const Configuration& c,
                                            const OptimizerOptions& limits) const {
  std::size_t lights = 0, mantissas = 0;
  for (std::size_t j = 0; j < c.lights; ++j) lights += max_light_bytes(candidates[order_[j]]);
  const ResidualSh& residual = residuals_[c.lights];
  // The encoder has one bit more.
  const int finest = finest_exponent(residual, c.band) - 1;
  const int exponent = c.step > 0 ? std::max(std::ilogb(c.step), finest) : finest;
  for (int l = 0; l <= c.band; ++l)
    if (is_sent(l, needs_all_bands(limits))) mantissas += round_band(residual, l, std::ldexp(1.0, exponent)).bytes;
  return lights + max_radiance_bytes(mantissas, exponent);
}

void DescriptorOptimizer::optimize(const Projection& scene, std::span<const Light> candidates, int required,
                                   const OptimizerOptions& limits, std::vector<Light>& selected,
                                   OptimizedDescriptor& out) {
  const BandWeights& w = band_weights();
  const auto most = std::min<std::size_t>(static_cast<std::size_t>(limits.max_lights), candidates.size());
  const ReferenceRms reference = begin(scene);
  out.scene_rms = reference.irradiance;
  const std::size_t shaped = std::min(candidates.size(), limits.epsilon > 0     ? kMaxConsidered
                                                         : limits.max_bytes > 0 ? std::max(most, kMaxConsidered)
                                                                                : most);
  for (std::size_t j = 0; j < shaped; ++j) shapes_[j] = shape_of(candidates[j]);
  if (required >= static_cast<int>(shaped))
    shapes_[static_cast<std::size_t>(required)] = shape_of(candidates[static_cast<std::size_t>(required)]);
  // Gains are relative to the scene's mean square over all channels.
  const auto inverse_mean_square =
      static_cast<float>(out.scene_rms.plain > 0 ? 1 / (out.scene_rms.plain * out.scene_rms.plain) : 0);

  bool all_bands = needs_all_bands(limits);
  Configuration chosen;
  if (limits.epsilon > 0) {
    order_lights(candidates, required, most, inverse_mean_square);
    chosen = fewest_bytes(candidates, required, limits, reference);
  } else {
    order_.clear();
    for (std::size_t j = 0; j < most; ++j) {
      order_.push_back(j);
      residuals_[j + 1] = residuals_[j];
      subtract(candidates[j], shapes_[j], residuals_[j + 1]);
    }
    chosen = {most, limits.band};
  }
  if (limits.max_bytes > 0 && wire_bytes(candidates, chosen, limits) > limits.max_bytes) {
    order_lights(candidates, -1, most, inverse_mean_square);
    chosen = least_error(candidates, limits, reference);
    all_bands = limits.radiance_epsilon > 0;
  }
  const std::size_t lights = chosen.lights;
  const int band = chosen.band;

  const ResidualSh& residual = residuals_[lights];
  double lost_irradiance[kBands][3], lost_radiance[kBands][3];
  truncation_energy(residual, all_bands, lost_irradiance, lost_radiance);
  out.truncation = rms(lost_irradiance[band]);
  out.step = chosen.step;
  out.residual = {};
  out.residual.band = band;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sh_count(band)); ++i)
    if (all_bands || w.irradiance[i] != 0)
      for (std::size_t k = 0; k < 3; ++k) out.residual.c[i][static_cast<int>(k)] = residual[k][i];

  selected.clear();
  for (std::size_t j = 0; j < candidates.size(); ++j)
    if (std::find(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(lights), j) !=
        order_.begin() + static_cast<std::ptrdiff_t>(lights))
      selected.push_back(candidates[j]);
  previous_tracks_.clear();
  for (const Light& light : selected) previous_tracks_.push_back(light.track);
  previous_band_ = band;
}

}  // namespace lightwell::estimate
