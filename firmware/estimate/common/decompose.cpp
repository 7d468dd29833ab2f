#include "estimate/common/decompose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <lightwell/cap.hpp>
#include <numbers>

namespace lightwell::estimate {
namespace {

constexpr int kLow = sh_count(kMaxBand);

/// For each function of a row its band and that band's cosine lobe, for even bands above 12 their sum over a point's.
struct Bands {
  std::array<int, kRowCount> band{};
  std::array<double, kRowCount> lobe{};
  double above_point = 0;  ///< Sum over even l > 12 of A_l² (2l+1), relative to the same over 8, 10 and 12.

  Bands() {
    std::size_t at = 0;
    for (int l = 0; l <= kMaxBand; ++l)
      for (int m = -l; m <= l; ++m) band[at++] = l;
    double seen = 0, above = 0;
    for (const int l : kTailBands) {
      for (int m = -l; m <= l; ++m) band[at++] = l;
      seen += (2 * l + 1) * cosine_lobe(l) * cosine_lobe(l);
    }
    for (std::size_t i = 0; i < kRowCount; ++i) lobe[i] = cosine_lobe(band[i]);
    for (int l = kTailBands.back() + 2; l <= 400; l += 2) above += (2 * l + 1) * cosine_lobe(l) * cosine_lobe(l);
    above_point = above / seen;
  }
};

const Bands& bands() {
  static const Bands b;
  return b;
}

IrradianceRms rms(const std::array<double, 3>& sum_of_squares) {
  constexpr double kSphere = 4 * std::numbers::pi;
  IrradianceRms out;
  for (std::size_t k = 0; k < 3; ++k) {
    out.plain += sum_of_squares[k] / 3;
    out.weighted += kLuminanceWeights[k] * sum_of_squares[k];
  }
  out.plain = std::sqrt(out.plain / kSphere);
  out.weighted = std::sqrt(out.weighted / kSphere);
  return out;
}

}  // namespace

double relative(const IrradianceRms& error, const IrradianceRms& whole) {
  const auto ratio = [](double e, double w) {
    if (e == 0) return 0.0;
    return w > 0 ? e / w : std::numeric_limits<double>::infinity();
  };
  return std::max(ratio(error.plain, whole.plain), ratio(error.weighted, whole.weighted));
}

IrradianceRms irradiance_rms(const Projection& scene) {
  const Bands& b = bands();
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) sum[k] += b.lobe[i] * b.lobe[i] * scene.c[i][k] * scene.c[i][k];
  return rms(sum);
}

Decomposition decompose(const Projection& scene, std::span<const Light> lights, int band) {
  const Bands& b = bands();
  Projection rest = scene;
  for (const Light& light : lights) {
    const BasisRow y = basis_row(vec_cast<double>(light.direction));
    std::array<double, kTailBands.back() + 1> zonal{};
    for (int l = 0; l <= kTailBands.back(); ++l)
      zonal[static_cast<std::size_t>(l)] = cap_zonal(l, light.angular_radius_rad);
    for (std::size_t i = 0; i < kRowCount; ++i) {
      const double shape = zonal[static_cast<std::size_t>(b.band[i])] * y[i];
      rest.c[i][0] -= shape * light.irradiance.r;
      rest.c[i][1] -= shape * light.irradiance.g;
      rest.c[i][2] -= shape * light.irradiance.b;
    }
  }
  Decomposition out;
  out.rest.band = std::clamp(band, 0, kMaxBand);
  std::array<double, 3> whole{}, lost{}, tail{};
  for (std::size_t i = 0; i < kRowCount; ++i) {
    const double a2 = b.lobe[i] * b.lobe[i];
    for (std::size_t k = 0; k < 3; ++k) {
      whole[k] += a2 * scene.c[i][k] * scene.c[i][k];
      const double e = a2 * rest.c[i][k] * rest.c[i][k];
      if (i >= kLow) tail[k] += e;
      if (b.band[i] > out.rest.band) lost[k] += e;
    }
    if (b.band[i] <= out.rest.band)
      for (std::size_t k = 0; k < 3; ++k) out.rest.c[i][static_cast<int>(k)] = static_cast<float>(rest.c[i][k]);
  }
  for (std::size_t k = 0; k < 3; ++k) lost[k] += b.above_point * tail[k];
  out.whole = rms(whole);
  out.truncation = rms(lost);
  return out;
}

}  // namespace lightwell::estimate
