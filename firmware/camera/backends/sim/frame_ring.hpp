// The simulated camera's pictures, rendered before streaming. Frames lend this memory; it is not written to again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell {

/// Times of exposure of the rows of a frame.
struct ExposureTiming {
  double readout_s = 0;  ///< Delay between successive rows.
  sim::MainsFlicker flicker;
  double frame_rate = 30;  ///< 1/s; frame times of a flickering scene.
  bool takes_time = true;  ///< False for the ideal sensor, whose exposures have no duration.
};

struct LensRenderer {
  sim::LensRays rays;
  sim::Sensor sensor;
  ExposureTiming timing;

  /// Radiance of a frame without flicker, by row if the probe rotates under a rolling shutter. `out`: r, g, b each.
  void radiance(const sim::Scene& scene, std::uint64_t index, std::span<float> out) const;
  /// Multiplies `steady` by the mean flicker of each row's exposure. Frame times are equally spaced; the middle row's
  /// exposure ends at them.
  void flicker(std::uint64_t index, double exposure_s, std::span<const float> steady, std::span<float> out) const;
};

/// Whether two frames show the same radiance: for a probe at rest, whether the lamps have the same state.
[[nodiscard]] bool same_light(const sim::Scene& scene, std::uint64_t index, std::uint64_t other);

/// Maps frame numbers to pictures and to states of the scene.
struct RingPlan {
  std::uint64_t cycle = 1;          ///< Number of frames after which the scene repeats.
  std::uint64_t switch_period = 0;  ///< Of the lamps, in frames; 0: they stay on.
  std::uint64_t bracket = 1;        ///< Exposures per bracket; the cycle of a moving scene is a multiple of it.
  /// 0 if the probe rotates: one picture per frame of the cycle. Otherwise the states differ only by the lamps, and
  /// each has this many pictures, which differ in exposure and noise.
  std::uint64_t realisations = 0;
  /// Periods of flicker per frame, adjusted so that a cycle contains a whole number of periods.
  double periods_per_frame = 0;
  std::uint64_t wanted = 1;  ///< Requested pictures; larger than pictures() if memory did not suffice.

  [[nodiscard]] std::uint64_t pictures() const;
  /// Index for Scene::state_at().
  [[nodiscard]] std::uint64_t scene_index(std::uint64_t sequence) const { return sequence % cycle; }
  [[nodiscard]] std::uint64_t picture(std::uint64_t sequence) const;
  /// The scene index of one of the frames that show `picture`.
  [[nodiscard]] std::uint64_t scene_index_of_picture(std::uint64_t picture) const;
};

struct RingRequest {
  std::uint64_t frames = 32;  ///< Cycle of a moving scene; rounded up to whole brackets and lamp periods.
  std::uint64_t bracket = 1;
  std::uint64_t switch_period = 0;
  std::size_t bytes_per_picture = 0;
  std::size_t memory_cap = std::size_t{1} << 30;
  double periods_per_frame = 0;  ///< Of mains flicker; 0: steady light.
};

/// Plan for a rotating probe, or flickering light. If memory does not suffice for the requested frames, the cycle is
/// shorter and the lamps switch faster. resource_exhausted if not even one bracket fits. With flicker, up to twice the
/// requested frames: the number that contains most nearly a whole number of periods.
[[nodiscard]] Result<RingPlan> plan_moving(const RingRequest& request);
/// Plan for a probe at rest: four brackets with different noise for each state of the lamps, or as many as fit.
[[nodiscard]] Result<RingPlan> plan_still(const RingRequest& request);

/// Inputs of rendering.
struct RingSource {
  const sim::Scene* scene = nullptr;
  const RigParameters* rig = nullptr;
  sim::SensorModel sensor;
  std::vector<double> exposure_s;  ///< The bracket.
  double gain = 1;
  ExposureTiming timing;
};

/// Called on rendering threads, one at a time, with the completed fraction, 0 to 1.
using RenderProgress = std::function<void(double)>;

class FrameRing {
 public:
  /// Renders on two threads. `progress` may be empty; it is called twice a second, after the first two seconds.
  void render(const RingPlan& plan, const RingSource& source, const RenderProgress& progress);

  [[nodiscard]] const RingPlan& plan() const { return plan_; }
  /// The bytes of one lens in a picture.
  [[nodiscard]] std::span<const std::byte> view(std::uint64_t picture, std::size_t lens) const;

 private:
  RingPlan plan_;
  std::vector<std::size_t> lens_start_;  ///< Byte offset by lens inside a picture; the last entry is its end.
  std::vector<std::byte> memory_;
};

}  // namespace lightwell
