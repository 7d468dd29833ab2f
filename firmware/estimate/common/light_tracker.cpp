#include "estimate/common/light_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::estimate {
namespace {

// A probe that turns at 180 deg/s moves a lamp by 6 deg from frame to frame at 30 frames/s.
const float kCosReach = std::cos(0.15F);
// One second at 30 frames/s.
constexpr int kForgetAfter = 30;
constexpr std::size_t kMaxKnown = 2 * kMaxLights;
// How quickly motion and strength are learnt: slowly enough to outlast the frames in which two lamps are one.
constexpr float kLearn = 0.2F;
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

void LightTracker::assign(std::span<Light> lights) {
  pairs_.clear();
  for (Known& k : known_) {
    k.taken = false;
    k.expected = normalized(k.direction + k.step);
  }
  for (std::size_t i = 0; i < lights.size(); ++i) {
    lights[i].track = 0;
    for (std::size_t j = 0; j < known_.size(); ++j) {
      const Known& k = known_[j];
      // Most pairs are far apart, which a product tells.
      if (std::max(dot(lights[i].direction, k.expected), dot(lights[i].direction, k.direction)) <= kCosReach) continue;
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
    if (old.unseen_for == 0) old.step += (found.direction - old.direction - old.step) * kLearn;
    old.luminance += (found.irradiance.luminance() - old.luminance) * kLearn;
    old.direction = found.direction;
    old.unseen_for = 0;
    old.taken = true;
  }
  for (Known& k : known_) {
    if (k.taken) continue;
    ++k.unseen_for;
    k.direction = normalized(k.direction + k.step);
  }
  std::erase_if(known_, [](const Known& k) { return k.unseen_for > kForgetAfter; });
  for (Light& light : lights) {
    if (light.track != 0) continue;
    light.track = next_++;
    if (next_ == 0) next_ = 1;
    if (known_.size() < kMaxKnown)
      known_.push_back({light.direction, {}, light.direction, light.irradiance.luminance(), light.track, 0, true});
  }
}

}  // namespace lightwell::estimate
