// What a simulated rig sees of a scene, as frames for an estimator: one ideal picture, or a bracket through a sensor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/status.hpp>

#include "camera/frame.hpp"
#include "estimate/estimator.hpp"
#include "sim/render.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell::measure {

/// Radiance at each photosite, a picture a lens.
using LensRadiance = std::vector<std::vector<float>>;

/// The frames borrow the pictures: a Shot may be moved, not copied.
struct Shot {
  std::vector<std::vector<std::byte>> pixels;
  std::vector<Frame> frames;
};

/// A rig and its sensors; what depends on the lenses alone is worked out once.
class Camera {
 public:
  Camera(const RigParameters& rig, PixelFormat format);

  [[nodiscard]] const RigParameters& rig() const { return rig_; }
  [[nodiscard]] PixelFormat format() const { return format_; }

  /// As densely sampled as the scene's panorama asks for.
  [[nodiscard]] LensRadiance render(const sim::Scene& scene, const sim::SceneState& state);

  /// Exposures evenly apart in stops: the shortest puts `peak` 5 % below saturation, the longest twice `mean`, and is
  /// at least four times the shortest. One, of a second, for rgb_f32, which has no ceiling.
  [[nodiscard]] std::vector<double> bracket_of_three(double peak, double mean) const;

  /// Capture number `capture` at 30 captures a second of a probe that has run for an hour: sequence numbers, times and
  /// latencies are as long on the wire as a daemon's.
  [[nodiscard]] Shot develop(const LensRadiance& radiance, std::span<const double> exposures,
                             std::uint64_t capture) const;

 private:
  RigParameters rig_;
  PixelFormat format_;
  std::vector<sim::Sensor> sensors_;
  std::vector<sim::LensRays> rays_;
  int samples_ = 0;
};

/// The largest number of any channel: no pixel of any picture exceeds a panorama's.
[[nodiscard]] double peak_of(std::span<const float> rgb);
/// Of all that the lenses see: their brightest channel, and their mean luminance.
[[nodiscard]] double peak_of(const LensRadiance& radiance);
[[nodiscard]] double mean_of(const LensRadiance& radiance);

/// What an application gets.
struct Delivered {
  Descriptor descriptor;
  std::size_t bytes = 0;  ///< Of the message.
};
/// From the frames through the estimator and over the wire: encoded, as a daemon says, 30 ms after mid-exposure.
[[nodiscard]] Result<Delivered> deliver(Estimator& estimator, const Shot& shot);

}  // namespace lightwell::measure
