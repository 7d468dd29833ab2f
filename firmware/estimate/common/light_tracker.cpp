#include "estimate/common/light_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::estimate {
namespace {

// How far from where it is expected a lamp may be found, rad: what a probe that turns at 180 deg/s moves it by, and
// what centroids are off; at 30 frames/s and above no less than kMinGate_rad. At low frame rates lamps further apart
// than kMaxGate_rad are different ones.
constexpr float kMaxAngularSpeed = 3.14F, kMinGate_rad = 0.15F, kMaxGate_rad = 0.5F;
constexpr float kMaxUnseen_s = 1;
// Motion is extrapolated over no more than this: a longer gap says nothing of where a lamp went.
constexpr float kMaxExtrapolation_s = 0.25F;
constexpr std::size_t kMaxKnown = 2 * kMaxLights;
// Time constant with which motion and strength are learnt, a fifth in a frame at 30 frames/s: slow enough to outlast
// the frames in which two lamps are one.
constexpr float kFilterTime_s = 0.15F;
// A factor of e in strength weighs as much as this angle; where a lamp is dimmed its place still tells.
constexpr float kRadPerLogIntensity = 0.03F;
constexpr float kMaxLogRatio = 2;

}  // namespace

LightTracker::LightTracker() {
  tracks_.reserve(kMaxKnown + kMaxLights);
  pairs_.reserve((kMaxKnown + kMaxLights) * kMaxLights);
}

float LightTracker::association_cost(const Track& known, const Light& light) {
  const float angle = angle_between(light.direction, known.expected);
  // Where it stood last counts too: what is taken for motion may be a lamp that swings.
  const float still = angle_between(light.direction, known.direction);
  const float strength = std::max(light.irradiance.luminance(), 1e-30F) / std::max(known.luminance, 1e-30F);
  return std::min(angle, still + 0.01F) + kRadPerLogIntensity * std::min(std::abs(std::log(strength)), kMaxLogRatio);
}

float LightTracker::advance(ProbeTime time) {
  // In double: the difference of two times that mean nothing may be more than 64 bits hold.
  const double s = time_ ? (static_cast<double>(time.ns) - static_cast<double>(time_->ns)) * 1e-9 : 0.0;
  time_ = time;
  return static_cast<float>(std::max(0.0, s));
}

void LightTracker::assign(std::span<Light> lights, ProbeTime time) {
  const float passed_s = advance(time), step_s = std::min(passed_s, kMaxExtrapolation_s);
  const float cos_reach = std::cos(std::clamp(0.045F + kMaxAngularSpeed * passed_s, kMinGate_rad, kMaxGate_rad));
  const float learn = 1 - std::exp(-passed_s / kFilterTime_s);
  pairs_.clear();
  for (Track& k : tracks_) {
    k.matched = false;
    k.expected = normalized(k.direction + k.velocity * step_s);
  }
  for (std::size_t i = 0; i < lights.size(); ++i) {
    lights[i].track = 0;
    for (std::size_t j = 0; j < tracks_.size(); ++j) {
      const Track& k = tracks_[j];
      // Most pairs are far apart, which a product tells.
      if (std::max(dot(lights[i].direction, k.expected), dot(lights[i].direction, k.direction)) <= cos_reach) continue;
      if (pairs_.size() < pairs_.capacity())
        pairs_.push_back({association_cost(k, lights[i]), static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
    }
  }
  std::sort(pairs_.begin(), pairs_.end());
  for (const Pair& pair : pairs_) {
    Light& found = lights[pair.light];
    Track& old = tracks_[pair.known];
    if (found.track != 0 || old.matched) continue;
    found.track = old.track;
    // Of one that was out of sight the motion between is not known: its own goes on.
    if (old.time_since_seen_s == 0 && passed_s > 0)
      old.velocity += ((found.direction - old.direction) * (1 / passed_s) - old.velocity) * learn;
    old.luminance += (found.irradiance.luminance() - old.luminance) * learn;
    old.direction = found.direction;
    old.time_since_seen_s = 0;
    old.matched = true;
  }
  for (Track& k : tracks_) {
    if (k.matched) continue;
    k.time_since_seen_s += passed_s;
    k.direction = k.expected;
  }
  std::erase_if(tracks_, [](const Track& k) { return k.time_since_seen_s > kMaxUnseen_s; });
  for (Light& light : lights) {
    if (light.track != 0) continue;
    light.track = next_++;
    if (next_ == 0) next_ = 1;
    if (tracks_.size() < kMaxKnown)
      tracks_.push_back({light.direction, {}, light.direction, light.irradiance.luminance(), light.track, 0, true});
  }
}

}  // namespace lightwell::estimate
