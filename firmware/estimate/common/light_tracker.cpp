#include "estimate/common/light_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::estimate {

// Radius of the association gate: the motion of a probe that rotates at 180 deg/s plus the error of centroids, clamped
// to [kMinGate_rad, kMaxGate_rad]. The lower limit applies at 30 frames/s and above.
constexpr float kMaxAngularSpeed = 3.14F, kMinGate_rad = 0.15F, kMaxGate_rad = 0.5F;
constexpr float kMaxUnseen_s = 1;
// Motion is extrapolated over at most this time.
constexpr float kMaxExtrapolation_s = 0.25F;
constexpr std::size_t kMaxTracks = 2 * kMaxLights;
// Time constant of the low-pass filters of velocity and luminance (gain 0.2 per frame at 30 frames/s): long compared
// with the time for which two crossing lamps are detected as one.
constexpr float kFilterTime_s = 0.15F;
// A factor of e in luminance costs as much as this angle, at most kMaxLogRatio times: a dimmed lamp stays assigned.
constexpr float kRadPerLogIntensity = 0.03F;
constexpr float kMaxLogRatio = 2;

LightTracker::LightTracker() {
  tracks_.reserve(kMaxTracks + kMaxLights);
  pairs_.reserve((kMaxTracks + kMaxLights) * kMaxLights);
}

float LightTracker::association_cost(const Track& track, const Light& light) {
  const float angle = angle_between(light.direction, track.expected);
  // The last observed direction is an alternative to the predicted one, for lamps that swing.
  const float still = angle_between(light.direction, track.direction);
  const float strength = std::max(light.irradiance.luminance(), 1e-30F) / std::max(track.luminance, 1e-30F);
  return std::min(angle, still + 0.01F) + kRadPerLogIntensity * std::min(std::abs(std::log(strength)), kMaxLogRatio);
}

float LightTracker::advance(ProbeTime time) {
  // In double: the difference of two invalid times may overflow 64 bits.
  const double s = time_ ? (static_cast<double>(time.ns) - static_cast<double>(time_->ns)) * 1e-9 : 0.0;
  time_ = time;
  return static_cast<float>(std::max(0.0, s));
}

void LightTracker::assign(std::span<Light> lights, ProbeTime time) {
  const float passed_s = advance(time), step_s = std::min(passed_s, kMaxExtrapolation_s);
  const float cos_reach = std::cos(std::clamp(0.045F + kMaxAngularSpeed * passed_s, kMinGate_rad, kMaxGate_rad));
  const float gain = 1 - std::exp(-passed_s / kFilterTime_s);
  pairs_.clear();
  for (Track& t : tracks_) {
    t.matched = false;
    t.expected = normalized(t.direction + t.velocity * step_s);
  }
  for (std::size_t i = 0; i < lights.size(); ++i) {
    lights[i].track = 0;
    for (std::size_t j = 0; j < tracks_.size(); ++j) {
      const Track& t = tracks_[j];
      // Rejects distant pairs, which are most, by a dot product.
      if (std::max(dot(lights[i].direction, t.expected), dot(lights[i].direction, t.direction)) <= cos_reach) continue;
      if (pairs_.size() < pairs_.capacity())
        pairs_.push_back(
            {association_cost(t, lights[i]), static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
    }
  }
  std::sort(pairs_.begin(), pairs_.end());
  for (const Pair& pair : pairs_) {
    Light& found = lights[pair.light];
    Track& old = tracks_[pair.track];
    if (found.track != 0 || old.matched) continue;
    found.track = old.id;
    // The velocity of a track that was not observed in the previous frame is left unchanged.
    if (old.time_since_seen_s == 0 && passed_s > 0)
      old.velocity += ((found.direction - old.direction) * (1 / passed_s) - old.velocity) * gain;
    old.luminance += (found.irradiance.luminance() - old.luminance) * gain;
    old.direction = found.direction;
    old.time_since_seen_s = 0;
    old.matched = true;
  }
  for (Track& t : tracks_) {
    if (t.matched) continue;
    t.time_since_seen_s += passed_s;
    t.direction = t.expected;
  }
  std::erase_if(tracks_, [](const Track& t) { return t.time_since_seen_s > kMaxUnseen_s; });
  for (Light& light : lights) {
    if (light.track != 0) continue;
    light.track = next_++;
    if (next_ == 0) next_ = 1;
    if (tracks_.size() < kMaxTracks)
      tracks_.push_back({light.direction, {}, light.direction, light.irradiance.luminance(), light.track, 0, true});
  }
}

}  // namespace lightwell::estimate
