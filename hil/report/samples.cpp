#include "report/samples.hpp"

#include <cmath>

#include <lightwell/equirect.hpp>

namespace lightwell::hil {
namespace {

constexpr double kGolden = 2.399963229728653;  // pi (3 - sqrt 5)

Radiance scaled(Irradiance e, float s) { return {e.r * s, e.g * s, e.b * s}; }

/// Adds directions of equal solid angle within the cap of a light (Fibonacci lattice).
void add_cap(const Light& light, std::vector<LightSample>& out) {
  constexpr int kCount = 64;
  const auto [u, v] = tangent_basis(vec_cast<double>(light.direction));
  const double span = 1 - std::cos(light.angular_radius_rad);
  double sum = 0;
  const std::size_t first = out.size();
  for (int i = 0; i < kCount; ++i) {
    const double c = 1 - span * (i + 0.5) / kCount, s = std::sqrt(std::max(0.0, 1 - c * c)), a = kGolden * i;
    const Vec3d d = vec_cast<double>(light.direction) * c + u * (s * std::cos(a)) + v * (s * std::sin(a));
    out.push_back({vec_cast<float>(d), {}});
    sum += c;
  }
  // The vector irradiance weights each direction by its cosine with the axis.
  for (std::size_t i = first; i < out.size(); ++i) out[i].flux = scaled(light.irradiance, static_cast<float>(1 / sum));
}

}  // namespace

std::vector<LightSample> samples_of(const Lighting& lighting) {
  std::vector<LightSample> out;
  for (const Light& light : lighting.lights()) add_cap(light, out);
  constexpr int kWidth = 48, kHeight = 24;
  for (int j = 0; j < kHeight; ++j) {
    const auto sr = static_cast<float>(equirect_solid_angle(j, kWidth, kHeight));
    for (int i = 0; i < kWidth; ++i) {
      const Vec3f d = vec_cast<float>(equirect_direction((i + 0.5) / kWidth, (j + 0.5) / kHeight));
      out.push_back({d, lighting.radiance(d, 0).value * sr});
    }
  }
  return out;
}

std::vector<LightSample> samples_of(const sim::Panorama& panorama, Quat rotation_world_probe) {
  std::vector<LightSample> out;
  constexpr int kJoin = 4;
  for (int j = 0; j + kJoin <= panorama.height; j += kJoin) {
    for (int i = 0; i + kJoin <= panorama.width; i += kJoin) {
      Vec3d toward;
      Radiance flux;
      for (int y = j; y < j + kJoin; ++y) {
        const auto sr = static_cast<float>(equirect_solid_angle(y, panorama.width, panorama.height));
        for (int x = i; x < i + kJoin; ++x) {
          const Radiance l = panorama.pixel(x, y) * sr;
          flux += l;
          toward += equirect_direction((x + 0.5) / panorama.width, (y + 0.5) / panorama.height) *
                    (static_cast<double>(l.luminance()) + 1e-12);
        }
      }
      out.push_back({vec_cast<float>(rotate(rotation_world_probe.inverse(), normalized(toward))), flux});
    }
  }
  return out;
}

std::vector<LightSample> thinned(const std::vector<LightSample>& samples, std::size_t count) {
  double total = 0;
  for (const LightSample& s : samples) total += std::abs(s.flux.luminance());
  std::vector<LightSample> out;
  if (!(total > 0)) return out;
  const double step = total / static_cast<double>(count);
  double at = 0, next = step / 2;
  Radiance skipped;
  for (const LightSample& s : samples) {
    const double l = std::abs(s.flux.luminance());
    skipped += s.flux;
    at += l;
    if (at < next) continue;
    // Flux skipped since the last chosen sample is added to this direction, because neighbours in the list are close.
    out.push_back({s.direction, skipped});
    skipped = {};
    while (next <= at) next += step;
  }
  return out;
}

}  // namespace lightwell::hil
