#include "estimate/common/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <lightwell/lobes.hpp>

namespace lightwell::estimate {
namespace {

BandWeights compute_weights() {
  BandWeights out{};
  std::size_t at = 0;
  const auto put = [&](int l, double k2) {
    for (int m = -l; m <= l; ++m, ++at) {
      out.band[at] = l;
      out.irradiance[at] = static_cast<float>(cosine_lobe(l) * cosine_lobe(l) / kSphere);
      out.radiance[at] = static_cast<float>(k2 / kSphere);
    }
  };
  const GgxLobe lobe(BandWeights::kRoughness);
  const auto low = lobe.coefficients();
  for (int l = 0; l <= kMaxBand; ++l) put(l, low[static_cast<std::size_t>(l)] * low[static_cast<std::size_t>(l)]);
  double counted = 0, above = 0;
  for (const int l : kTailBands) {
    // K_l by its definition, the integral of the lobe times P_l. Odd bands are not computed from images; each is
    // assumed to be as strong as the even band above it.
    const auto k = [&](int band) {
      return 2 * std::numbers::pi *
             lobe.integral(0, 1, [&](double x) { return std::legendre(static_cast<unsigned>(band), x); });
    };
    const double even = k(l), odd = k(l - 1);
    put(l, even * even + odd * odd * (2 * l - 1) / (2 * l + 1));
    counted += (2 * l + 1) * cosine_lobe(l) * cosine_lobe(l);
  }
  for (int l = kTailBands.back() + 2; l <= 400; l += 2) above += (2 * l + 1) * cosine_lobe(l) * cosine_lobe(l);
  out.above_irradiance = above / counted;
  return out;
}

}  // namespace

const BandWeights& band_weights() {
  static const BandWeights weights = compute_weights();
  return weights;
}

IrradianceRms rms(const double (&squares)[3]) {
  return {std::sqrt((squares[0] + squares[1] + squares[2]) / 3),
          std::sqrt(luminance_of(squares[0], squares[1], squares[2]))};
}

double relative(const IrradianceRms& error, const IrradianceRms& whole) {
  const auto ratio = [](double e, double w) {
    if (e == 0) return 0.0;
    return w > 0 ? e / w : std::numeric_limits<double>::infinity();
  };
  return std::max(ratio(error.plain, whole.plain), ratio(error.weighted, whole.weighted));
}

IrradianceRms irradiance_rms(const Projection& scene) {
  const BandWeights& w = band_weights();
  double squares[3] = {};
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) squares[k] += w.irradiance[i] * scene.c[i][k] * scene.c[i][k];
  return rms(squares);
}

}  // namespace lightwell::estimate
