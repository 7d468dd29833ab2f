// Keeps a lamp's track number from descriptor to descriptor.
#pragma once

#include <lightwell/descriptor.hpp>
#include <span>
#include <vector>

namespace lightwell::estimate {

/// Greedy nearest neighbour: the closest pair of an old and a new light within `reach_rad` keeps its number, then the
/// next closest. What is left gets a number never used before. A lamp that vanishes keeps its number for a while, so
/// that one which flickers stays the same lamp.
class LightTracker {
 public:
  LightTracker();
  /// Sets `track` of every light. Allocates nothing.
  void assign(std::span<Light> lights);

 private:
  struct Known {
    Vec3f direction;
    std::uint32_t track = 0;
    int unseen_for = 0;
    bool taken = false;
  };
  std::vector<Known> known_;
  std::uint32_t next_ = 1;
};

}  // namespace lightwell::estimate
