#include "core/interpolate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <lightwell/fibonacci_lattice.hpp>
#include <lightwell/harmonics.hpp>

#include "core/light_rotation.hpp"
#include "core/receiver_lights.hpp"

namespace lightwell::core {
namespace {

float blend(float a, float b, float f) { return a + (b - a) * f; }

std::int64_t blend_ns(std::int64_t a, std::int64_t b, float f) {
  return a + static_cast<std::int64_t>(static_cast<double>(b - a) * static_cast<double>(f));
}

/// The fraction f of the shortest rotation from a to b (unit vectors). Between opposite directions there is no shortest
/// rotation; then it is the identity.
Quat partial_rotation(Vec3d a, Vec3d b, double f) {
  const Vec3d axis = normalized(cross(a, b));
  if (axis == Vec3d{}) return {};
  return Quat::about(axis, angle_between(a, b) * f);
}

Light between(const Light& a, const Light& b, float f) {
  const Vec3d from = vec_cast<double>(a.direction), to = vec_cast<double>(b.direction);
  const Quat forward = partial_rotation(from, to, static_cast<double>(f));
  const Quat backward = partial_rotation(to, from, 1 - static_cast<double>(f));
  Light out = f < 0.5F ? a : b;
  // Rotate from the nearer end, so that opposite directions switch half-way instead of staying at one end.
  const Vec3d direction = f < 0.5F ? rotate(forward, from) : rotate(backward, to);
  out.direction = vec_cast<float>(normalized(direction));
  out.irradiance = a.irradiance * (1 - f) + b.irradiance * f;
  out.angular_radius_rad = blend(a.angular_radius_rad, b.angular_radius_rad, f);
  const auto from_a = transport_covariance(a.direction_covariance, a.direction, forward, out.direction);
  const auto from_b = transport_covariance(b.direction_covariance, b.direction, backward, out.direction);
  for (std::size_t i = 0; i < 3; ++i) out.direction_covariance[i] = blend(from_a[i], from_b[i], f);
  return out;
}

const Light* with_track(const std::vector<Light>& lights, std::uint32_t track) {
  if (track == 0) return nullptr;
  const auto found =
      std::find_if(lights.begin(), lights.end(), [&](const Light& light) { return light.track == track; });
  return found == lights.end() ? nullptr : &*found;
}

std::vector<Light> blend_lights(const std::vector<Light>& a, const std::vector<Light>& b, float f) {
  std::vector<Light> out;
  out.reserve(a.size() + b.size());
  const auto faded = [&](const Light& light, float share) {
    out.push_back(light);
    out.back().irradiance = light.irradiance * share;
  };
  for (const Light& light : a) {
    if (const Light* same = with_track(b, light.track))
      out.push_back(between(light, *same, f));
    else
      faded(light, 1 - f);
  }
  for (const Light& light : b)
    if (with_track(a, light.track) == nullptr) faded(light, f);
  std::stable_sort(out.begin(), out.end(),
                   [](const Light& x, const Light& y) { return x.irradiance.luminance() > y.irradiance.luminance(); });
  if (out.size() > kMaxLights) out.resize(kMaxLights);
  return out;
}

RadianceSh blend_harmonics(const RadianceSh& a, const RadianceSh& b, float f) {
  RadianceSh out;
  out.band = std::max(a.band, b.band);
  const auto of = [](const RadianceSh& sh, int i) {
    return i < sh.count() ? sh.c[static_cast<std::size_t>(i)] : Radiance{};
  };
  for (int i = 0; i < out.count(); ++i) out.c[static_cast<std::size_t>(i)] = of(a, i) * (1 - f) + of(b, i) * f;
  return out;
}

ErrorBound worse(const ErrorBound& a, const ErrorBound& b) {
  return {std::max(a.total, b.total), std::max(a.truncation, b.truncation),     std::max(a.sampling, b.sampling),
          std::max(a.noise, b.noise), std::max(a.quantization, b.quantization), std::max(a.smoothing, b.smoothing)};
}

/// RMS over all normals of the luminance of the irradiance.
double rms_irradiance(const Descriptor& descriptor) {
  constexpr int kNormals = 64;
  const IrradianceSh harmonics = irradiance_of(descriptor.radiance);
  const std::vector<ReceiverLight> lights = receiver_lights(descriptor.lights);
  double sum = 0;
  for (int i = 0; i < kNormals; ++i) {
    const Vec3d d = fibonacci_direction(i, kNormals), n{d.x, d.z, d.y};
    const double e = (evaluate(harmonics, vec_cast<float>(n)) + irradiance_on(lights, n)).luminance();
    sum += e * e;
  }
  return std::sqrt(sum / kNormals);
}

}  // namespace

Descriptor extrapolated(const Descriptor& before, const Descriptor& newest, float f) {
  Descriptor out = newest;
  if (before.units != newest.units || before.calibration_id != newest.calibration_id ||
      before.probe_id != newest.probe_id || !(f > 0))
    return out;
  out.time.mid_exposure.ns += static_cast<std::int64_t>(
      static_cast<double>((newest.time.mid_exposure - before.time.mid_exposure).ns) * static_cast<double>(f));
  double moved2 = 0;
  for (Light& light : out.lights) {
    const Light* earlier = with_track(before.lights, light.track);
    if (earlier == nullptr) continue;
    const Vec3d from = vec_cast<double>(earlier->direction), to = vec_cast<double>(light.direction);
    const double turn = angle_between(from, to);
    if (!(turn > 0)) continue;
    const double share = std::min(static_cast<double>(f), std::numbers::pi / turn);
    light = rotate_light(light, partial_rotation(from, to, share));
    // A small rotation of a light by an angle changes the clamped cosine by the angle times sin(theta) cos(phi); the
    // RMS over all normals is the angle over sqrt(6).
    moved2 += std::pow(share * turn * static_cast<double>(light.irradiance.luminance()), 2) / 6;
  }
  if (moved2 > 0) {
    const double rms = rms_irradiance(newest);
    out.bound.total += rms > 0 ? static_cast<float>(std::sqrt(moved2) / rms) : std::numeric_limits<float>::infinity();
  }
  return out;
}

bool blends(const Descriptor& a, const Descriptor& b) {
  return a.units == b.units && a.calibration_id == b.calibration_id;
}

Descriptor interpolated(const Descriptor& a, const Descriptor& b, float f) {
  const Descriptor& nearer = f < 0.5F ? a : b;
  if (!blends(a, b)) return nearer;
  Descriptor out = nearer;
  out.time.mid_exposure.ns = blend_ns(a.time.mid_exposure.ns, b.time.mid_exposure.ns, f);
  out.radiance = blend_harmonics(a.radiance, b.radiance, f);
  out.lights = blend_lights(a.lights, b.lights, f);
  out.coverage = std::min(a.coverage, b.coverage);
  out.saturated = std::max(a.saturated, b.saturated);
  out.bound = worse(a.bound, b.bound);
  for (const Flag flag : kFlags)
    if (a.flags.has(flag) || b.flags.has(flag)) out.flags.set(flag);
  return out;
}

}  // namespace lightwell::core
