#include "estimate/common/smoother.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lightwell::estimate {
namespace {

constexpr double kInnovationThreshold = 2.5;
constexpr double kChangeThreshold = 4;
// What passes for a step where the clock stands still.
constexpr double kNominalStep = 1.0 / 30;
constexpr int kSmoothedCoefficients = sh_count(kMaxBand);

/// `slowest` for what noise explains, 1 for what it does not.
double gain_for_innovation(double normalized_innovation, double slowest) {
  if (!(normalized_innovation < kChangeThreshold)) return 1;
  return slowest + (1 - slowest) * std::max(0.0, (normalized_innovation - kInnovationThreshold) / (kChangeThreshold - kInnovationThreshold));
}

/// Variance of a mean, with what a new value of variance `fresh` and weight `gain` adds.
double variance_after(double variance, double gain, double fresh) {
  return (1 - gain) * (1 - gain) * variance + gain * gain * fresh;
}

double mixed(double old, double fresh, double gain) { return gain < 1 ? old + gain * (fresh - old) : fresh; }

/// Replaces what is not finite. True where there was nothing to replace.
bool replace_non_finite(Projection& scene, const Projection& by) {
  bool sound = true;
  for (std::size_t i = 0; i < kRowCount; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::isfinite(scene.c[i][k])) continue;
      scene.c[i][k] = by.c[i][k];
      sound = false;
    }
  }
  return sound;
}

bool finite(const Light& light) {
  const Vec3f d = light.direction;
  const Irradiance e = light.irradiance;
  const auto& c = light.direction_covariance;
  return std::isfinite(d.x) && std::isfinite(d.y) && std::isfinite(d.z) && std::isfinite(e.r) && std::isfinite(e.g) &&
         std::isfinite(e.b) && std::isfinite(light.angular_radius_rad) && std::isfinite(c[0]) && std::isfinite(c[1]) &&
         std::isfinite(c[2]);
}

/// The same covariance, said in the tangent basis of another direction nearby: that basis turns by half where z
/// changes its sign.
std::array<float, 3> in_basis_of(const std::array<float, 3>& covariance, Vec3f from, Vec3f to) {
  const auto old = tangent_basis(vec_cast<double>(from)), fresh = tangent_basis(vec_cast<double>(to));
  const auto variance = [&](std::size_t a, std::size_t b) {
    const double au = dot(fresh[a], old[0]), av = dot(fresh[a], old[1]);
    const double bu = dot(fresh[b], old[0]), bv = dot(fresh[b], old[1]);
    const double uu = covariance[0], uv = covariance[1], vv = covariance[2];
    return static_cast<float>(au * bu * uu + (au * bv + av * bu) * uv + av * bv * vv);
  };
  return {variance(0, 0), variance(0, 1), variance(1, 1)};
}

/// Means of unit vectors are shorter than one; vectors that are as long as floats allow stay as they are to the bit.
Vec3f unit(Vec3d d) {
  const double l = length(d);
  return std::abs(l - 1) < 2e-7 ? vec_cast<float>(d) : vec_cast<float>(normalized(d));
}

}  // namespace

Smoother::Smoother(double time_constant_s) : tau_s_(time_constant_s > 0 ? time_constant_s : 0) {
  Projection ones;
  for (auto& c : ones.c) c = {1, 1, 1};
  white_ = irradiance_rms(ones).plain;
}

void Smoother::reset() {
  started_ = false;
  changed_ = false;
  light_count_ = 0;
  variance_ = 0;
  smoothed_ = {};
}

double Smoother::residual_noise() const { return std::sqrt(variance_); }

double Smoother::normalized_innovation(const Projection& difference, const IrradianceRms& rms) const {
  double squares = 0;
  for (std::size_t i = 0; i < kSmoothedCoefficients; ++i)
    for (const double v : difference.c[i]) squares += v * v;
  const double irradiance = std::max(rms.plain, rms.weighted);
  return std::max(irradiance, white_ * std::sqrt(squares / (3 * kSmoothedCoefficients)));
}

IrradianceRms Smoother::apply(Projection& scene, std::span<Light> lights, ProbeTime time, double noise_rms) {
  bool sound = replace_non_finite(scene, smoothed_);
  for (Light& light : lights) {
    if (finite(light)) continue;
    light = {.direction = {0, 0, -1}, .irradiance = {}, .track = light.track};
    sound = false;
  }
  // Differences of doubles: those of clocks gone mad do not overflow.
  double dt = (static_cast<double>(time.ns) - static_cast<double>(time_.ns)) * 1e-9;
  if (dt < 0) reset();
  if (dt == 0) dt = kNominalStep;
  time_ = time;

  const double noise = std::isfinite(noise_rms) && noise_rms > 0 ? noise_rms : 0;
  Projection difference;
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) difference.c[i][k] = scene.c[i][k] - smoothed_.c[i][k];
  const IrradianceRms all = irradiance_rms(difference);

  double gain = 1, slowest = 1;
  const double expected = variance_ + noise * noise;
  if (started_ && noise > 0 && tau_s_ > 0 && expected > 0) {
    const double at_rest = -std::expm1(-dt / tau_s_);
    const double surprised = normalized_innovation(difference, all) / std::sqrt(expected);
    slowest = at_rest;
    gain = changed_ ? 1 : gain_for_innovation(surprised, std::max(variance_ / expected, at_rest));
    changed_ = !(surprised < kChangeThreshold);
  } else {
    changed_ = false;
  }
  started_ = noise > 0;
  variance_ = variance_after(variance_, gain, noise * noise);
  smooth_lights(lights, gain, slowest, noise);
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      smoothed_.c[i][k] = gain < 1 ? smoothed_.c[i][k] + gain * difference.c[i][k] : scene.c[i][k];
  scene = smoothed_;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  if (!sound) return {kInfinite, kInfinite};
  return gain < 1 ? IrradianceRms{(1 - gain) * all.plain, (1 - gain) * all.weighted} : IrradianceRms{};
}

/// `gain` is that of the scene; no light is slower than `slowest`, nor than the mean of the frames that it was seen in.
void Smoother::smooth_lights(std::span<Light> lights, double gain, double slowest, double noise_rms) {
  std::swap(lights_, previous_lights_);
  const std::span<const SmoothedLight> former(previous_lights_.data(), light_count_);
  light_count_ = 0;
  for (Light& light : lights) {
    if (light.track == 0 || light_count_ == lights_.size()) continue;
    SmoothedLight& lamp = lights_[light_count_++];
    const Vec3d found = vec_cast<double>(light.direction);
    const auto old = std::find_if(former.begin(), former.end(), [&](const SmoothedLight& f) { return f.track == light.track; });
    double own = 1;
    lamp = {};
    lamp.track = light.track;
    if (old != former.end()) {
      lamp = *old;
      // A lamp of vector irradiance E gives E / sqrt(6) RMS over all normals.
      double squares = 0;
      for (int k = 0; k < 3; ++k) {
        const double more = light.irradiance[k] - lamp.irradiance[static_cast<std::size_t>(k)];
        squares += more * more / 18;
      }
      const auto deviations = [&](double squared, double variance) {
        return squared == 0 ? 0 : std::sqrt(squared / (std::max(variance, 0.0) * (1 + lamp.variance)));
      };
      const Vec3d off = found - lamp.direction;
      const double brightness = deviations(squares, noise_rms * noise_rms);
      const double place =
          deviations(dot(off, off), static_cast<double>(light.direction_covariance[0]) + light.direction_covariance[2]);
      const double at_rest = std::max(lamp.variance / (1 + lamp.variance), slowest);
      own = std::max(gain, gain_for_innovation(std::max(brightness, place), at_rest));
    }
    lamp.variance = variance_after(lamp.variance, own, 1);
    lamp.direction = {mixed(lamp.direction.x, found.x, own), mixed(lamp.direction.y, found.y, own),
                      mixed(lamp.direction.z, found.z, own)};
    for (int k = 0; k < 3; ++k) {
      double& e = lamp.irradiance[static_cast<std::size_t>(k)];
      e = mixed(e, light.irradiance[k], own);
      light.irradiance[k] = static_cast<float>(e);
    }
    lamp.angular_radius_rad = mixed(lamp.angular_radius_rad, light.angular_radius_rad, own);
    light.angular_radius_rad = static_cast<float>(lamp.angular_radius_rad);
    const Vec3f direction = unit(lamp.direction);
    if (direction == light.direction) continue;
    light.direction_covariance = in_basis_of(light.direction_covariance, light.direction, direction);
    light.direction = direction;
  }
}

}  // namespace lightwell::estimate
