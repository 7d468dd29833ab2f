#include "core/history.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>

namespace lightwell::core {
namespace {

/// Whether the two can be interpolated.
bool blends(const Descriptor& a, const Descriptor& b) {
  return a.units == b.units && a.calibration_id == b.calibration_id;
}

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
  if (a.distance_m > 0 && b.distance_m > 0) {
    out.distance_m = blend(a.distance_m, b.distance_m, f);
    out.distance_sigma_m = blend(a.distance_sigma_m, b.distance_sigma_m, f);
  }
  return out;
}

/// Rotation about one axis by the shorter way (Shoemake 1985, "Animating rotation with quaternion curves"), translation
/// along the line.
Pose blend_poses(const Pose& a, const Pose& b, double f) {
  if (a == b) return a;
  Quat turn = a.rotation.inverse() * b.rotation;
  if (turn.w < 0) turn = {-turn.x, -turn.y, -turn.z, -turn.w};
  const Vec3d imaginary{turn.x, turn.y, turn.z};
  const Quat part = Quat::about(normalized(imaginary), 2 * f * std::atan2(length(imaginary), turn.w));
  return {(a.rotation * part).normalized(), a.translation * (1 - f) + b.translation * f};
}

const Light* with_track(const std::vector<Light>& lights, std::uint32_t track) {
  if (track == 0) return nullptr;
  const auto found = std::ranges::find(lights, track, &Light::track);
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

/// Stale if the age can exceed max_age within the clock uncertainty.
Validity validity_of(Duration age, const Sample& sample, Duration max_age) {
  return age + sample.time_uncertainty > max_age ? Validity::stale : Validity::valid;
}

Lighting held(std::shared_ptr<const Sample> sample, HostTime time, Duration max_age,
              Derivation derivation = Derivation::measured) {
  const Duration age = std::max(time - sample->mid_exposure, Duration{});
  const Validity validity = validity_of(age, *sample, max_age);
  return {std::move(sample), validity, age, max_age, derivation};
}

/// Sample of an interpolated or extrapolated descriptor; all that is not derived from it is copied from `nearer`.
std::shared_ptr<const Sample> made_of(Descriptor descriptor, const Sample& nearer,
                                      LazyReconstruction::Pointer reconstruction, HostTime time) {
  Sample made = sample_of(std::move(descriptor));
  made.reconstruction = std::move(reconstruction);
  made.mid_exposure = time;
  made.time_uncertainty = nearer.time_uncertainty;
  made.received = nearer.received;
  made.encoded_bytes = nearer.encoded_bytes;
  made.environment = nearer.environment;
  if (made.environment) made.environment_rotation = map_rotation(made.descriptor, *made.environment);
  made.T_world_probe = nearer.T_world_probe;
  // The nearer sample has no map, and the other one had a map or other units.
  if (!made.reconstruction) add_reconstruction(made);
  return std::make_shared<const Sample>(std::move(made));
}

Lighting beyond_newest(const History& history, HostTime time, Duration max_age, Duration extrapolation) {
  const auto& samples = history.samples;
  const std::shared_ptr<const Sample>& newest = samples.back();
  const Duration ahead = time - newest->mid_exposure;
  if (ahead > extrapolation) return held(newest, time, max_age, Derivation::held);
  // Measure the velocity over at least the extrapolated time: a shorter baseline would amplify the noise.
  const auto from = std::upper_bound(samples.begin(), samples.end() - 1, newest->mid_exposure - ahead,
                                     [](HostTime t, const auto& sample) { return t < sample->mid_exposure; });
  if (from == samples.begin()) return held(newest, time, max_age, Derivation::held);
  const Sample& before = **(from - 1);
  const Duration back = newest->mid_exposure - before.mid_exposure;
  // No extrapolation across a gap, in which the motion of the lights is unknown.
  if (back > max_age) return held(newest, time, max_age, Derivation::held);
  const auto f = static_cast<float>(ahead.seconds() / back.seconds());
  const Validity validity = validity_of(ahead, *newest, max_age);
  return {made_of(extrapolated(before.descriptor, newest->descriptor, f), *newest, newest->reconstruction, time),
          validity, ahead, max_age, Derivation::extrapolated};
}

}  // namespace

Descriptor extrapolated(const Descriptor& before, const Descriptor& newest, float f) {
  Descriptor out = newest;
  if (!blends(before, newest) || before.probe_id != newest.probe_id || !(f > 0)) return out;
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

Descriptor interpolated(const Descriptor& a, const Descriptor& b, float f) {
  const Descriptor& nearer = f < 0.5F ? a : b;
  if (!blends(a, b)) return nearer;
  Descriptor out = nearer;
  out.time.mid_exposure.ns = blend_ns(a.time.mid_exposure.ns, b.time.mid_exposure.ns, f);
  out.radiance = blend_harmonics(a.radiance, b.radiance, f);
  out.lights = blend_lights(a.lights, b.lights, f);
  out.T_probe_origin = blend_poses(a.T_probe_origin, b.T_probe_origin, static_cast<double>(f));
  out.coverage = std::min(a.coverage, b.coverage);
  out.saturated = std::max(a.saturated, b.saturated);
  out.bound = worse(a.bound, b.bound);
  for (const Flag flag : kFlags)
    if (a.flags.has(flag) || b.flags.has(flag)) out.flags.set(flag);
  return out;
}

std::shared_ptr<const History> appended(const History* before, std::shared_ptr<const Sample> sample,
                                        std::size_t capacity) {
  auto after = std::make_shared<History>();
  if (before != nullptr) {
    const auto& old = before->samples;
    const auto end =
        std::find_if(old.begin(), old.end(), [&](const auto& s) { return s->mid_exposure >= sample->mid_exposure; });
    const auto count = std::min(static_cast<std::size_t>(end - old.begin()), capacity - 1);
    after->samples.reserve(count + 1);
    after->samples.assign(end - static_cast<std::ptrdiff_t>(count), end);
  }
  after->samples.push_back(std::move(sample));
  return after;
}

Lighting newest_lighting(const History* history, HostTime now, Duration max_age) {
  if (history == nullptr) return {nullptr, Validity::none, {}, max_age};
  return held(history->samples.back(), now, max_age);
}

Lighting lighting_at(const History* history, HostTime time, Duration max_age, Duration extrapolation) {
  if (history == nullptr) return {nullptr, Validity::none, {}, max_age};
  const auto& samples = history->samples;
  const auto next = std::upper_bound(samples.begin(), samples.end(), time,
                                     [](HostTime t, const auto& sample) { return t < sample->mid_exposure; });
  if (next == samples.begin()) return {nullptr, Validity::before_history, {}, max_age};
  const std::shared_ptr<const Sample>& before = *(next - 1);
  if (before->mid_exposure == time) return held(before, time, max_age);
  if (next == samples.end()) return beyond_newest(*history, time, max_age, extrapolation);

  const std::shared_ptr<const Sample>& after = *next;
  const Duration span = after->mid_exposure - before->mid_exposure;
  const Duration into = time - before->mid_exposure;
  const auto f = static_cast<float>(into.seconds() / span.seconds());
  const Sample& nearer = f < 0.5F ? *before : *after;
  // Time to the nearest descriptor: inside a long gap an interpolated answer is stale.
  const Duration age = std::min(into, span - into);
  const Validity validity = validity_of(age, nearer, max_age);
  LazyReconstruction::Pointer reconstruction;
  if (before->reconstruction && after->reconstruction && blends(before->descriptor, after->descriptor))
    reconstruction = std::make_shared<const LazyReconstruction>(before->reconstruction, after->reconstruction, f);
  return {made_of(interpolated(before->descriptor, after->descriptor, f), nearer, std::move(reconstruction), time),
          validity, age, max_age, Derivation::interpolated};
}

}  // namespace lightwell::core
