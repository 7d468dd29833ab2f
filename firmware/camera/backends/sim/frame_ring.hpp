// The simulated camera's pictures, rendered before it starts: a frame is then a loan of memory that
// is never written to again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "camera/backends/sim/lens_renderer.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell {

/// Which picture a frame shows, and which state of the scene that is.
struct RingPlan {
  std::uint64_t cycle = 1;          ///< Frames after which the scene repeats.
  std::uint64_t switch_period = 0;  ///< In frames; 0: lamps stay on.
  std::uint64_t bracket = 1;        ///< Exposures; the cycle of a moving scene is a multiple.
  /// 0 where the probe turns: a picture for each frame of the cycle. Otherwise only the lamps tell
  /// states apart, and each state has so many pictures, which differ in exposure and noise.
  std::uint64_t realisations = 0;
  /// Periods of flicker in a frame, so that a cycle holds a whole number of them.
  double periods_per_frame = 0;
  std::uint64_t wanted = 1;  ///< Pictures; more than pictures() where memory did not allow them.

  [[nodiscard]] std::uint64_t pictures() const;
  /// Index for Scene::state_at().
  [[nodiscard]] std::uint64_t scene_index(std::uint64_t sequence) const { return sequence % cycle; }
  [[nodiscard]] std::uint64_t picture(std::uint64_t sequence) const;
  /// Of the frames that show a picture, the scene index of one.
  [[nodiscard]] std::uint64_t scene_index_of_picture(std::uint64_t picture) const;
};

struct RingRequest {
  std::uint64_t frames = 32;  ///< Of a moving scene; rounded up to whole brackets and periods.
  std::uint64_t bracket = 1;
  std::uint64_t switch_period = 0;
  std::size_t bytes_per_picture = 0;
  std::size_t memory_cap = std::size_t{1} << 30;
  double periods_per_frame = 0;  ///< Of the mains' flicker; 0: light is steady.
};

/// For a turning probe, or light that flickers. Where memory does not allow the frames asked for, fewer, and lamps that
/// switch faster with them. resource_exhausted where not even one bracket fits. With flicker, up to twice the frames
/// asked for: the number in which the periods come nearest to a whole one.
[[nodiscard]] Result<RingPlan> plan_moving(const RingRequest& request);
/// For a probe at rest: four brackets of noise for each state of the lamps, fewer where memory does
/// not allow them.
[[nodiscard]] Result<RingPlan> plan_still(const RingRequest& request);

/// What is rendered for.
struct RingSource {
  const sim::Scene* scene = nullptr;
  const RigParameters* rig = nullptr;
  sim::SensorModel sensor;
  std::vector<double> exposure_s;  ///< The bracket.
  double gain = 1;
  ExposureTiming timing;
};

/// Called from any rendering thread, one at a time, with the share that is done, 0 to 1.
using RenderProgress = std::function<void(double)>;

class FrameRing {
 public:
  /// Renders on two threads. `progress` may be empty; it is called when two seconds have passed,
  /// twice a second.
  void render(const RingPlan& plan, const RingSource& source, const RenderProgress& progress);

  [[nodiscard]] const RingPlan& plan() const { return plan_; }
  /// A lens's bytes in a picture.
  [[nodiscard]] std::span<const std::byte> view(std::uint64_t picture, std::size_t lens) const;

 private:
  RingPlan plan_;
  std::vector<std::size_t> lens_start_;  ///< Inside a picture; one more entry for its end.
  std::vector<std::byte> memory_;
};

}  // namespace lightwell
