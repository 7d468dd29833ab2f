// Keeps a lamp's track number from descriptor to descriptor.
#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>

namespace lightwell::estimate {

/// Greedy nearest neighbour: the best pair of a known and a new light keeps its number, then the next best. A known
/// light is looked for where its motion has taken it, and one that gives as much light as before fits better: so two
/// lamps that cross keep their numbers, though they were one bright spot for a while. What is left gets a number never
/// used before. A lamp that vanishes keeps its number for a while, so that one which flickers stays the same lamp.
class LightTracker {
 public:
  LightTracker();
  /// Sets `track` of every light. Allocates nothing.
  void assign(std::span<Light> lights);

 private:
  struct Known {
    Vec3f direction;
    Vec3f step;           ///< From one frame to the next.
    Vec3f expected;       ///< Where its motion takes it.
    float luminance = 0;  ///< Of its irradiance, over the last frames.
    std::uint32_t track = 0;
    int unseen_for = 0;
    bool taken = false;
  };
  /// A known light and one of this frame that are near enough to be the same.
  struct Pair {
    float misfit;
    std::uint32_t light, known;
    friend auto operator<=>(const Pair&, const Pair&) = default;
  };
  /// Of taking `light` for `known`.
  [[nodiscard]] static float misfit(const Known& known, const Light& light);

  std::vector<Known> known_;
  std::vector<Pair> pairs_;
  std::uint32_t next_ = 1;
};

}  // namespace lightwell::estimate
