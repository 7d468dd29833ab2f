#include "estimate/common/light_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::estimate {
namespace {

// How far from where it is expected a lamp may be found, rad: what a probe that turns at 180 deg/s moves it by, and
// what centroids are off; at 30 frames/s and above no less than kLeastReach. At low frame rates lamps further apart
// than kLargestReach are different ones.
constexpr float kFastestTurn = 3.14F, kLeastReach = 0.15F, kLargestReach = 0.5F;
constexpr float kForgetAfter_s = 1;
// Motion is extrapolated over no more than this: a longer gap says nothing of where a lamp went.
constexpr float kLongestStep_s = 0.25F;
constexpr std::size_t kMaxKnown = 2 * kMaxLights;
// Time constant with which motion and strength are learnt, a fifth in a frame at 30 frames/s: slow enough to outlast
// the frames in which two lamps are one.
constexpr float kLearn_s = 0.15F;
// A factor of e in strength weighs as much as this angle; where a lamp is dimmed its place still tells.
constexpr float kPerLogRad = 0.03F;
constexpr float kMostLog = 2;

}  // namespace

LightTracker::LightTracker() {
  known_.reserve(kMaxKnown + kMaxLights);
  pairs_.reserve((kMaxKnown + kMaxLights) * kMaxLights);
}

float LightTracker::misfit(const Known& known, const Light& light) {
  const float angle = angle_between(light.direction, known.expected);
  // Where it stood last counts too: what is taken for motion may be a lamp that swings.
  const float still = angle_between(light.direction, known.direction);
  const float strength = std::max(light.irradiance.luminance(), 1e-30F) / std::max(known.luminance, 1e-30F);
  return std::min(angle, still + 0.01F) + kPerLogRad * std::min(std::abs(std::log(strength)), kMostLog);
}

float LightTracker::advance(ProbeTime time) {
  // In double: the difference of two times that mean nothing may be more than 64 bits hold.
  const double s = time_ ? (static_cast<double>(time.ns) - static_cast<double>(time_->ns)) * 1e-9 : 0.0;
  time_ = time;
  return static_cast<float>(std::max(0.0, s));
}

void LightTracker::assign(std::span<Light> lights, ProbeTime time) {
  const float passed_s = advance(time), step_s = std::min(passed_s, kLongestStep_s);
  const float cos_reach = std::cos(std::clamp(0.045F + kFastestTurn * passed_s, kLeastReach, kLargestReach));
  const float learn = 1 - std::exp(-passed_s / kLearn_s);
  pairs_.clear();
  for (Known& k : known_) {
    k.taken = false;
    k.expected = normalized(k.direction + k.velocity * step_s);
  }
  for (std::size_t i = 0; i < lights.size(); ++i) {
    lights[i].track = 0;
    for (std::size_t j = 0; j < known_.size(); ++j) {
      const Known& k = known_[j];
      // Most pairs are far apart, which a product tells.
      if (std::max(dot(lights[i].direction, k.expected), dot(lights[i].direction, k.direction)) <= cos_reach) continue;
      if (pairs_.size() < pairs_.capacity())
        pairs_.push_back({misfit(k, lights[i]), static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
    }
  }
  std::sort(pairs_.begin(), pairs_.end());
  for (const Pair& pair : pairs_) {
    Light& found = lights[pair.light];
    Known& old = known_[pair.known];
    if (found.track != 0 || old.taken) continue;
    found.track = old.track;
    // Of one that was out of sight the motion between is not known: its own goes on.
    if (old.unseen_s == 0 && passed_s > 0)
      old.velocity += ((found.direction - old.direction) * (1 / passed_s) - old.velocity) * learn;
    old.luminance += (found.irradiance.luminance() - old.luminance) * learn;
    old.direction = found.direction;
    old.unseen_s = 0;
    old.taken = true;
  }
  for (Known& k : known_) {
    if (k.taken) continue;
    k.unseen_s += passed_s;
    k.direction = k.expected;
  }
  std::erase_if(known_, [](const Known& k) { return k.unseen_s > kForgetAfter_s; });
  for (Light& light : lights) {
    if (light.track != 0) continue;
    light.track = next_++;
    if (next_ == 0) next_ = 1;
    if (known_.size() < kMaxKnown)
      known_.push_back({light.direction, {}, light.direction, light.irradiance.luminance(), light.track, 0, true});
  }
}

}  // namespace lightwell::estimate
