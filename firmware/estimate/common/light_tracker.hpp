// Keeps a lamp's track number from descriptor to descriptor.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/time.hpp>

namespace lightwell::estimate {

/// Greedy nearest neighbour: the best pair of a known and a new light keeps its number, then the next best. A known
/// light is looked for where its motion has taken it, and one that gives as much light as before fits better: so two
/// lamps that cross keep their numbers, though they were one bright spot for a while. What is left gets a number never
/// used before. A lamp that vanishes keeps its number for a second, so that one which flickers stays the same lamp.
/// All of this is in time, whatever the frame rate. Where time stands still or goes backwards nothing moves and nothing
/// is forgotten.
class LightTracker {
 public:
  LightTracker();
  /// Sets `track` of every light of a frame, whose exposure's middle is `time`. Allocates nothing.
  void assign(std::span<Light> lights, ProbeTime time);

 private:
  struct Track {
    Vec3f direction;
    Vec3f velocity;       ///< Of its direction, 1/s.
    Vec3f expected;       ///< Where its motion takes it.
    float luminance = 0;  ///< Of its irradiance, over the last frames.
    std::uint32_t track = 0;
    float time_since_seen_s = 0;  ///< Time since it was found.
    bool matched = false;
  };
  /// A known light and one of this frame that are near enough to be the same.
  struct Pair {
    float association_cost;
    std::uint32_t light, known;
    friend auto operator<=>(const Pair&, const Pair&) = default;
  };
  /// Of taking `light` for `known`.
  [[nodiscard]] static float association_cost(const Track& known, const Light& light);

  /// Of this frame's: seconds since the one before; 0 where time does not go on.
  [[nodiscard]] float advance(ProbeTime time);

  std::vector<Track> tracks_;
  std::vector<Pair> pairs_;
  std::optional<ProbeTime> time_;  ///< Of the latest frame.
  std::uint32_t next_ = 1;
};

}  // namespace lightwell::estimate
