#include "estimate/common/chooser.hpp"

#include <algorithm>
#include <cmath>
#include <lightwell/cap.hpp>
#include <limits>
#include <numbers>

namespace lightwell::estimate {
namespace {

constexpr std::size_t kLow = sh_count(kMaxBand);
constexpr double kSphere = 4 * std::numbers::pi;

/// Share of the limit that a prediction may reach: the truncation is exact but for the bands above 12, the other errors
/// are expected values.
constexpr double kMargin = 0.9;
/// A poorer choice than the last one is taken where it reaches at most this share of the limit.
constexpr double kRoom = 0.8;
/// Share of the limit that rounding may take. In quadrature it costs a hundredth of that.
constexpr double kRoundingShare = 0.3;
/// Bytes of a light, and of what else there is in a message (see proto/README.md, caps and sizes).
constexpr double kLightBytes = 32, kOtherBytes = 64;
/// A light that was sent before counts for so much more: two that are alike must not take turns.
constexpr double kLoyalty = 0.8;

/// What a zigzag varint of a rounded number takes.
double varint_bytes(double value, double inverse_step) {
  const double m = std::abs(value) * inverse_step;
  return m < 63.5 ? 1 : m < 8191.5 ? 2 : 3;
}

/// By how much the bands up to `band` may be rounded.
double allowed_step(int band, bool all_bands, double allowed_rms) {
  double sum = 0;
  for (int l = 0; l <= band; ++l)
    if (all_bands || cosine_lobe(l) != 0) sum += (2 * l + 1) * std::max(cosine_lobe(l) * cosine_lobe(l), all_bands ? 0.1 : 0.0);
  // Rounding by a step q has the variance q²/12 in every coefficient.
  return allowed_rms / std::sqrt(sum / kSphere / 12);
}

/// The largest power of two that is no larger.
int exponent_within(double step) {
  return step > 0 && std::isfinite(step) ? std::clamp(static_cast<int>(std::floor(std::log2(step))), -140, 100) : -140;
}

}  // namespace

Chooser::Chooser() : shapes_(kMaxLights), rests_(kMaxLights + 1) {
  order_.reserve(kMaxLights);
  kept_before_.reserve(kMaxLights);
  (void)band_weights();
}

bool Chooser::was_kept(std::uint32_t track) const {
  return std::find(kept_before_.begin(), kept_before_.end(), track) != kept_before_.end();
}

void Chooser::subtract(const Light& light, const Shape& shape, Rest& rest) const {
  for (int k = 0; k < 3; ++k) {
    const float e = light.irradiance[k];
    float* __restrict c = rest.c[k];
    for (std::size_t i = 0; i < kRowCount; ++i) c[i] -= e * shape.y[i];
  }
}

double Chooser::left_above_two(const Rest& rest, const Light& light, const Shape& shape,
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

void Chooser::order_lights(std::span<const Light> found, int must, std::size_t most,
                           const float (&inverse_whole)[3]) {
  order_.clear();
  const std::size_t considered = std::min(found.size(), kMostConsidered);
  Light none;
  for (std::size_t step = 0; step < most && step < considered; ++step) {
    std::size_t best = considered;
    double least = std::numeric_limits<double>::infinity();
    if (step == 0 && must >= 0) {
      best = static_cast<std::size_t>(must);
    } else {
      const double now = left_above_two(rests_[step], none, shapes_[0], inverse_whole);
      for (std::size_t j = 0; j < considered; ++j) {
        if (std::find(order_.begin(), order_.end(), j) != order_.end()) continue;
        double gain = now - left_above_two(rests_[step], found[j], shapes_[j], inverse_whole);
        if (was_kept(found[j].track)) gain /= kLoyalty;
        if (-gain < least) {
          least = -gain;
          best = j;
        }
      }
      if (best == considered || !(least < 0)) break;
    }
    order_.push_back(best);
    rests_[step + 1] = rests_[step];
    subtract(found[best], shapes_[best], rests_[step + 1]);
  }
}

void Chooser::lost_above(const Rest& rest, bool all_bands, double (&irradiance)[kBands][3],
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

void Chooser::choose(const Projection& scene, std::span<const Light> found, int must,
                     const ChoiceLimits& limits, std::vector<Light>& kept, Chosen& out) {
  const BandWeights& w = band_weights();
  const bool all_bands = limits.radiance_epsilon > 0 || !(limits.epsilon > 0);
  const auto most = std::min<std::size_t>(static_cast<std::size_t>(limits.max_lights), found.size());
  double whole2[3] = {}, whole_radiance2[3] = {};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < kRowCount; ++i) {
      rests_[0].c[k][i] = static_cast<float>(scene.c[i][k]);
      whole2[k] += w.irradiance[i] * scene.c[i][k] * scene.c[i][k];
      whole_radiance2[k] += w.radiance[i] * scene.c[i][k] * scene.c[i][k];
    }
  }
  out.whole = rms(whole2);
  const IrradianceRms whole_radiance = rms(whole_radiance2);
  const std::size_t shaped = std::min(found.size(), limits.epsilon > 0 ? kMostConsidered : most);
  const auto shape = [&](std::size_t j) {
    const BasisRow y = basis_row(vec_cast<double>(found[j].direction));
    float zonal[kTailBands.back() + 1];
    for (int l = 0; l <= kTailBands.back(); ++l) zonal[l] = static_cast<float>(cap_zonal(l, found[j].angular_radius_rad));
    for (std::size_t i = 0; i < kRowCount; ++i) shapes_[j].y[i] = zonal[w.band[i]] * y[i];
  };
  for (std::size_t j = 0; j < shaped; ++j) shape(j);
  if (must >= static_cast<int>(shaped)) shape(static_cast<std::size_t>(must));

  std::size_t lights = 0;
  int band = limits.band;
  double irradiance_lost[kBands][3], radiance_lost[kBands][3];
  if (limits.epsilon > 0) {
    // Relative to the whole, over all channels as errors are counted.
    const auto inverse = static_cast<float>(out.whole.plain > 0 ? 1 / (out.whole.plain * out.whole.plain) : 0);
    order_lights(found, must, most, {inverse, inverse, inverse});
    Option best, fallback;
    best.bytes = fallback.excess = std::numeric_limits<double>::infinity();
    // The step will be a power of two between all and half of that. To reckon with the one it will be would choose
    // otherwise for a scene that is the same but brighter.
    const double step = allowed_step(limits.band, all_bands, kRoundingShare * limits.epsilon * out.whole.plain);
    const double inverse_step = step > 0 ? std::numbers::sqrt2 / step : 0;
    for (std::size_t n = must >= 0 && !order_.empty() ? 1 : 0; n <= order_.size(); ++n) {
      if (kOtherBytes + kLightBytes * static_cast<double>(n) > best.bytes) break;
      lost_above(rests_[n], all_bands, irradiance_lost, radiance_lost);
      bool same_lights = n == kept_before_.size();
      for (std::size_t j = 0; j < n && same_lights; ++j) same_lights = was_kept(found[order_[j]].track);
      double bytes = kOtherBytes + kLightBytes * static_cast<double>(n);
      for (int l = 0; l <= limits.band; ++l) {
        if (!all_bands && l > 1 && l % 2 != 0) continue;
        for (std::size_t i = static_cast<std::size_t>(l * l); i < static_cast<std::size_t>(sh_count(l)); ++i)
          for (std::size_t k = 0; k < 3; ++k) bytes += varint_bytes(rests_[n].c[k][i], inverse_step);
        Option o{n, l, bytes, 0, same_lights && l == band_before_};
        const double truncation = relative(rms(irradiance_lost[l]), out.whole);
        o.excess = std::hypot(truncation, limits.other_error, kRoundingShare / 2 * limits.epsilon) / (kMargin * limits.epsilon);
        if (limits.radiance_epsilon > 0)
          o.excess = std::max(o.excess, relative(rms(radiance_lost[l]), whole_radiance) / (kMargin * limits.radiance_epsilon));
        if (o.excess < 0.98 * fallback.excess) fallback = o;
        const bool poorer = n < kept_before_.size() || l < band_before_;
        if (o.excess > (poorer ? kRoom : 1.0)) continue;
        // What was sent before is left only for a fair gain.
        const double price = o.same_as_before ? 0.93 * bytes : bytes;
        if (price < best.bytes) {
          best = o;
          best.bytes = price;
        }
      }
    }
    const Option& taken = std::isfinite(best.bytes) ? best : fallback;
    lights = taken.lights;
    band = taken.band;
  } else {
    order_.clear();
    for (std::size_t j = 0; j < shaped; ++j) {
      order_.push_back(j);
      rests_[j + 1] = rests_[j];
      subtract(found[j], shapes_[j], rests_[j + 1]);
    }
    lights = shaped;
  }

  const Rest& rest = rests_[lights];
  lost_above(rest, all_bands, irradiance_lost, radiance_lost);
  out.truncation = rms(irradiance_lost[band]);
  out.step = limits.epsilon > 0 && out.whole.plain > 0
                 ? std::ldexp(1.0F, exponent_within(allowed_step(band, all_bands, kRoundingShare * limits.epsilon * out.whole.plain)))
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
  kept_before_.clear();
  for (const Light& light : kept) kept_before_.push_back(light.track);
  band_before_ = band;
}

}  // namespace lightwell::estimate
