// Assigns track numbers to lights that persist from descriptor to descriptor.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/time.hpp>

namespace lightwell::estimate {

/// Greedy nearest-neighbour data association with constant-velocity prediction (Blackman 1986, "Multiple-target
/// tracking with radar applications"). The pair of track and light with the lowest cost is assigned first, then the
/// next. The cost includes the change of intensity, so that two lamps that cross keep their numbers, even if they were
/// one bright region for a while. Unassigned lights get new numbers. A track without a light is kept for one second.
/// All parameters are in seconds, independent of the frame rate. Where time stands still or runs backwards, tracks
/// neither move nor expire.
class LightTracker {
 public:
  LightTracker();
  /// Sets `track` of every light of a frame; `time`: its mid-exposure. Allocates nothing.
  void assign(std::span<Light> lights, ProbeTime time);

 private:
  struct Track {
    Vec3f direction;
    Vec3f velocity;       ///< Time derivative of the direction, 1/s.
    Vec3f expected;       ///< Predicted direction in the current frame, unit.
    float luminance = 0;  ///< Of the irradiance, low-pass filtered.
    std::uint32_t id = 0;
    float time_since_seen_s = 0;  ///< Time since the last assignment.
    bool matched = false;
  };
  /// A track and a light of the frame within the gate.
  struct Pair {
    float association_cost;
    std::uint32_t light, track;
    friend auto operator<=>(const Pair&, const Pair&) = default;
  };
  /// Cost of assigning `light` to `track`: an angle, rad, plus a term for the change of intensity.
  [[nodiscard]] static float association_cost(const Track& track, const Light& light);

  /// Sets the current time; returns the seconds since the previous frame, 0 where time does not advance.
  [[nodiscard]] float advance(ProbeTime time);

  std::vector<Track> tracks_;
  std::vector<Pair> pairs_;
  std::optional<ProbeTime> time_;  ///< Of the latest frame.
  std::uint32_t next_ = 1;
};

}  // namespace lightwell::estimate
