// Analytic projections and lamps with noise of known variance, as input of a smoother.
#pragma once

#include <cmath>
#include <cstring>
#include <random>
#include <span>

#include <lightwell/cap.hpp>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

inline constexpr std::int64_t kFrame = 33'333'333;

[[nodiscard]] inline ProbeTime frame_time(int frame) { return {1'000'000'000 + frame * kFrame}; }

/// A sky, brighter above, with an irradiance of about `level`.
[[nodiscard]] inline Projection sky(double level = 1) {
  Projection p;
  for (std::size_t k = 0; k < 3; ++k) {
    p.c[0][k] = level * (1.1 + 0.1 * static_cast<double>(k));
    p.c[1][k] = 0.4 * level;
    p.c[12][k] = -0.05 * level;
    p.c[80][k] = 0.01 * level;
  }
  return p;
}

inline void add_cap(Projection& p, const Light& light) {
  const BasisRow y = basis_row(vec_cast<double>(light.direction));
  std::size_t at = 0;
  const auto put = [&](int l) {
    const double zonal = cap_zonal(l, light.angular_radius_rad);
    for (int m = -l; m <= l; ++m, ++at)
      for (int k = 0; k < 3; ++k) p.c[at][static_cast<std::size_t>(k)] += zonal * y[at] * light.irradiance[k];
  };
  for (int l = 0; l <= kMaxBand; ++l) put(l);
  for (const int l : kTailBands) put(l);
}

[[nodiscard]] inline Light lamp(Vec3f towards, float irradiance, std::uint32_t track) {
  Light light;
  light.direction = normalized(towards);
  light.irradiance = {irradiance, 0.9F * irradiance, 0.7F * irradiance};
  light.angular_radius_rad = 0.03F;
  light.direction_covariance = {1e-6F, 2e-7F, 3e-6F};
  light.track = track;
  return light;
}

[[nodiscard]] inline IrradianceRms rms(const Projection& p) { return irradiance_rms(p); }

[[nodiscard]] inline Projection difference(const Projection& a, const Projection& b) {
  Projection out;
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) out.c[i][k] = a.c[i][k] - b.c[i][k];
  return out;
}

[[nodiscard]] inline Projection without(const Projection& p, std::span<const Light> lights) {
  Projection caps;
  for (const Light& light : lights) add_cap(caps, light);
  return difference(p, caps);
}

[[nodiscard]] inline bool equal(const Projection& a, const Projection& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Noise that is white over directions with an RMS irradiance of `n`.
class Noise {
 public:
  explicit Noise(double n, std::uint64_t seed = 1) : random_(seed) {
    Projection ones;
    for (auto& c : ones.c) c = {1, 1, 1};
    sigma_ = n / rms(ones).plain;
  }
  void add(Projection& p) {
    for (auto& c : p.c)
      for (double& v : c) v += sigma_ * normal_(random_);
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double sigma_;
};

}  // namespace lightwell::estimate
