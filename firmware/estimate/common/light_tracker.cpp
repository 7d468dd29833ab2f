#include "estimate/common/light_tracker.hpp"

#include <algorithm>

namespace lightwell::estimate {
namespace {

// A probe that turns at 180 deg/s moves a lamp by 6 deg from frame to frame at 30 frames/s.
constexpr float kReachRad = 0.15F;
// One second at 30 frames/s.
constexpr int kForgetAfter = 30;
constexpr std::size_t kMaxKnown = 2 * kMaxLights;

}  // namespace

LightTracker::LightTracker() { known_.reserve(kMaxKnown + kMaxLights); }

void LightTracker::assign(std::span<Light> lights) {
  for (Known& k : known_) k.taken = false;
  for (Light& light : lights) light.track = 0;
  for (;;) {
    float nearest = kReachRad;
    Known* old = nullptr;
    Light* found = nullptr;
    for (Light& light : lights) {
      if (light.track != 0) continue;
      for (Known& k : known_) {
        if (k.taken) continue;
        const float angle = angle_between(light.direction, k.direction);
        if (angle < nearest) {
          nearest = angle;
          old = &k;
          found = &light;
        }
      }
    }
    if (found == nullptr) break;
    found->track = old->track;
    *old = {found->direction, old->track, 0, true};
  }
  for (Known& k : known_)
    if (!k.taken) ++k.unseen_for;
  std::erase_if(known_, [](const Known& k) { return k.unseen_for > kForgetAfter; });
  for (Light& light : lights) {
    if (light.track != 0) continue;
    light.track = next_++;
    if (next_ == 0) next_ = 1;
    if (known_.size() < kMaxKnown) known_.push_back({light.direction, light.track, 0, true});
  }
}

}  // namespace lightwell::estimate
