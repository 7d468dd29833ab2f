#include "estimate/common/smoother.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lightwell::estimate {
namespace {

constexpr double kInnovationThreshold = 2.5;
constexpr double kChangeThreshold = 4;
// Time step, s, where the clock stands still.
constexpr double kNominalStep = 1.0 / 30;
constexpr int kInnovationCoefficients = sh_count(kMaxBand);

/// `min_gain` for an innovation that noise explains, 1 for one that it does not.
double gain_for_innovation(double normalized_innovation, double min_gain) {
  if (!(normalized_innovation < kChangeThreshold)) return 1;
  return min_gain + (1 - min_gain) * std::max(0.0, (normalized_innovation - kInnovationThreshold) /
                                                       (kChangeThreshold - kInnovationThreshold));
}

/// Variance of a mean after a new value with variance `fresh` and weight `gain`.
double variance_after(double variance, double gain, double fresh) {
  return (1 - gain) * (1 - gain) * variance + gain * gain * fresh;
}

double interpolate(double old, double fresh, double gain) { return gain < 1 ? old + gain * (fresh - old) : fresh; }

/// Replaces coefficients that are not finite. Returns true where all were finite.
bool replace_non_finite(Projection& scene, const Projection& by) {
  bool all_finite = true;
  for (std::size_t i = 0; i < kRowCount; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::isfinite(scene.c[i][k])) continue;
      scene.c[i][k] = by.c[i][k];
      all_finite = false;
    }
  }
  return all_finite;
}

bool finite(const Light& light) {
  const Vec3f d = light.direction;
  const Irradiance e = light.irradiance;
  const auto [uu, uv, vv] = light.direction_covariance;
  return std::ranges::all_of(std::array{d.x, d.y, d.z, e.r, e.g, e.b, light.angular_radius_rad, uu, uv, vv},
                             [](float v) { return std::isfinite(v); });
}

/// Converts a covariance to the tangent basis of a direction nearby: it is rotated by 180 degrees where z changes sign.
std::array<float, 3> change_basis(const std::array<float, 3>& covariance, Vec3f from, Vec3f to) {
  const auto old = tangent_basis(vec_cast<double>(from)), fresh = tangent_basis(vec_cast<double>(to));
  const auto variance = [&](std::size_t a, std::size_t b) {
    const double au = dot(fresh[a], old[0]), av = dot(fresh[a], old[1]);
    const double bu = dot(fresh[b], old[0]), bv = dot(fresh[b], old[1]);
    const double uu = covariance[0], uv = covariance[1], vv = covariance[2];
    return static_cast<float>(au * bu * uu + (au * bv + av * bu) * uv + av * bv * vv);
  };
  return {variance(0, 0), variance(0, 1), variance(1, 1)};
}

/// Normalizes means of unit vectors, which are shorter than 1; unchanged where 1 within float precision.
Vec3f unit(Vec3d d) {
  const double l = length(d);
  return std::abs(l - 1) < 2e-7 ? vec_cast<float>(d) : vec_cast<float>(normalized(d));
}

}  // namespace

Smoother::Smoother(double time_constant_s) : tau_s_(time_constant_s > 0 ? time_constant_s : 0) {
  Projection ones;
  for (auto& c : ones.c) c = {1, 1, 1};
  white_rms_ = irradiance_rms(ones).plain;
}

void Smoother::reset() {
  started_ = false;
  previous_frame_changed_ = false;
  light_count_ = 0;
  variance_ = 0;
  smoothed_ = {};
}

double Smoother::residual_noise() const { return std::sqrt(variance_); }

double Smoother::normalized_innovation(const Projection& difference, const IrradianceRms& rms) const {
  double squares = 0;
  for (std::size_t i = 0; i < kInnovationCoefficients; ++i)
    for (const double v : difference.c[i]) squares += v * v;
  const double irradiance = std::max(rms.plain, rms.weighted);
  return std::max(irradiance, white_rms_ * std::sqrt(squares / (3 * kInnovationCoefficients)));
}

IrradianceRms Smoother::apply(Projection& scene, std::span<Light> lights, ProbeTime time, double noise_rms) {
  bool all_finite = replace_non_finite(scene, smoothed_);
  for (Light& light : lights) {
    if (finite(light)) continue;
    light = {.direction = {0, 0, -1}, .irradiance = {}, .track = light.track};
    all_finite = false;
  }
  // In double: the difference of invalid times may overflow 64 bits.
  double dt = (static_cast<double>(time.ns) - static_cast<double>(time_.ns)) * 1e-9;
  if (dt < 0) reset();
  if (dt == 0) dt = kNominalStep;
  time_ = time;

  const double noise = std::isfinite(noise_rms) && noise_rms > 0 ? noise_rms : 0;
  Projection difference;
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) difference.c[i][k] = scene.c[i][k] - smoothed_.c[i][k];
  const IrradianceRms all = irradiance_rms(difference);

  double gain = 1, min_gain = 1;
  const double expected = variance_ + noise * noise;
  if (started_ && noise > 0 && tau_s_ > 0 && expected > 0) {
    const double at_rest = -std::expm1(-dt / tau_s_);
    const double innovation = normalized_innovation(difference, all) / std::sqrt(expected);
    min_gain = at_rest;
    gain = previous_frame_changed_ ? 1 : gain_for_innovation(innovation, std::max(variance_ / expected, at_rest));
    previous_frame_changed_ = !(innovation < kChangeThreshold);
  } else {
    previous_frame_changed_ = false;
  }
  started_ = noise > 0;
  variance_ = variance_after(variance_, gain, noise * noise);
  smooth_lights(lights, gain, min_gain, noise);
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      smoothed_.c[i][k] = gain < 1 ? smoothed_.c[i][k] + gain * difference.c[i][k] : scene.c[i][k];
  scene = smoothed_;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  if (!all_finite) return {kInfinite, kInfinite};
  return gain < 1 ? IrradianceRms{(1 - gain) * all.plain, (1 - gain) * all.weighted} : IrradianceRms{};
}

/// The gain of a light is at least `gain` (of the scene), `min_gain` and that of the mean over its track's frames.
void Smoother::smooth_lights(std::span<Light> lights, double gain, double min_gain, double noise_rms) {
  std::swap(lights_, previous_lights_);
  const std::span<const SmoothedLight> previous(previous_lights_.data(), light_count_);
  light_count_ = 0;
  for (Light& light : lights) {
    if (light.track == 0 || light_count_ == lights_.size()) continue;
    SmoothedLight& smoothed = lights_[light_count_++];
    const Vec3d found = vec_cast<double>(light.direction);
    const auto old =
        std::find_if(previous.begin(), previous.end(), [&](const SmoothedLight& f) { return f.track == light.track; });
    double light_gain = 1;
    smoothed = {};
    smoothed.track = light.track;
    if (old != previous.end()) {
      smoothed = *old;
      // A light of vector irradiance E causes an RMS irradiance of E / sqrt(6) over all normals.
      double squares = 0;
      for (int k = 0; k < 3; ++k) {
        const double more = light.irradiance[k] - smoothed.irradiance[static_cast<std::size_t>(k)];
        squares += more * more / 18;
      }
      const auto in_sigmas = [&](double squared, double variance) {
        return squared == 0 ? 0 : std::sqrt(squared / (variance * (1 + smoothed.variance)));
      };
      const Vec3d off = found - smoothed.direction;
      const double irradiance_change = in_sigmas(squares, noise_rms * noise_rms);
      const double direction_change =
          in_sigmas(dot(off, off), static_cast<double>(light.direction_covariance[0]) + light.direction_covariance[2]);
      const double at_rest = std::max(smoothed.variance / (1 + smoothed.variance), min_gain);
      light_gain = std::max(gain, gain_for_innovation(std::max(irradiance_change, direction_change), at_rest));
    }
    smoothed.variance = variance_after(smoothed.variance, light_gain, 1);
    smoothed.direction = {interpolate(smoothed.direction.x, found.x, light_gain),
                          interpolate(smoothed.direction.y, found.y, light_gain),
                          interpolate(smoothed.direction.z, found.z, light_gain)};
    for (int k = 0; k < 3; ++k) {
      double& e = smoothed.irradiance[static_cast<std::size_t>(k)];
      e = interpolate(e, light.irradiance[k], light_gain);
      light.irradiance[k] = static_cast<float>(e);
    }
    smoothed.angular_radius_rad = interpolate(smoothed.angular_radius_rad, light.angular_radius_rad, light_gain);
    light.angular_radius_rad = static_cast<float>(smoothed.angular_radius_rad);
    const Vec3f direction = unit(smoothed.direction);
    if (direction == light.direction) continue;
    light.direction_covariance = change_basis(light.direction_covariance, light.direction, direction);
    light.direction = direction;
  }
}

}  // namespace lightwell::estimate
