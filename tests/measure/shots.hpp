// Renders a scene with a simulated rig and exposes it through the sensor model: frames for an estimator, one ideal
// image or a bracket per lens.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/status.hpp>

#include "estimate/estimator.hpp"
#include "imaging/frame.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell::measure {

/// Radiance at each photosite, one image per lens.
using LensRadiance = std::vector<std::vector<float>>;

/// The frames refer to `pixels`, so a Shot may be moved but not copied.
struct Shot {
  std::vector<std::vector<std::byte>> pixels;
  std::vector<Frame> frames;
};

/// A rig with its sensors; data that depend only on the lenses are computed once.
class Camera {
 public:
  Camera(const RigParameters& rig, PixelFormat format);

  [[nodiscard]] const RigParameters& rig() const { return rig_; }
  [[nodiscard]] PixelFormat format() const { return format_; }

  /// Renders each lens with enough samples per pixel for the scene's panorama.
  [[nodiscard]] LensRadiance render(const sim::Scene& scene, const sim::SceneState& state);

  /// Three exposure times in seconds, in equal ratios: the shortest puts `peak` 5 % below saturation, the longest twice
  /// `mean`, and is at least four times the shortest. For rgb_f32, which does not saturate, a single exposure of 1 s.
  [[nodiscard]] std::vector<double> bracket_of_three(double peak, double mean) const;

  /// Exposes the sensors. The frame has number `capture` after an hour at 30 captures per second, so that sequence
  /// numbers, times and latencies are as long on the wire as those of a daemon.
  [[nodiscard]] Shot expose(const LensRadiance& radiance, std::span<const double> exposures,
                            std::uint64_t capture) const;

  /// The same of pictures that were exposed before: `pixels` as in its result.
  [[nodiscard]] Shot exposed(std::vector<std::vector<std::byte>> pixels, std::span<const double> exposures,
                             std::uint64_t capture) const;

 private:
  RigParameters rig_;
  PixelFormat format_;
  std::vector<sim::Sensor> sensors_;
  std::vector<sim::LensRays> rays_;
  int samples_ = 0;
};

/// The largest value of any channel; for a panorama, an upper limit for all images of it.
[[nodiscard]] double peak_of(std::span<const float> rgb);
/// The largest channel and the mean luminance over all lenses.
[[nodiscard]] double peak_of(const LensRadiance& radiance);
[[nodiscard]] double mean_of(const LensRadiance& radiance);

/// A descriptor as an application receives it.
struct Delivered {
  Descriptor descriptor;
  std::size_t bytes = 0;  ///< Size of the encoded message.
};
/// Estimates, encodes and decodes a descriptor; its encoding time is 30 ms after mid-exposure.
[[nodiscard]] Result<Delivered> deliver(Estimator& estimator, const Shot& shot);

}  // namespace lightwell::measure
