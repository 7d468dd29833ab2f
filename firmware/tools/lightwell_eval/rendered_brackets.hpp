// Pictures of a panorama: what the cameras of the sweep see of it, as frames.
#pragma once

#include <cstddef>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "camera/frame.hpp"
#include "sim/scene.hpp"

namespace lightwell::eval {

/// One bracket of a pair of lenses back to back, in one piece of memory.
struct RenderedBracket {
  RigParameters rig;
  PixelFormat format = PixelFormat::rgb8;
  std::vector<double> exposures;
  std::vector<std::byte> bytes;
  std::vector<std::size_t> offsets;  ///< Of each picture: exposure by exposure, lens by lens.

  /// Frames that look into `memory`, which is laid out as `bytes` is. `number` counts captures of a camera of 30 a
  /// second.
  [[nodiscard]] std::vector<Frame> frames(std::span<const std::byte> memory, std::uint64_t number) const;
};

/// Renders each camera's radiance once and develops it as often as asked.
class Camera {
 public:
  /// Takes about two seconds for 2 x 1280x960.
  [[nodiscard]] static Result<Camera> make(const sim::Scene& scene, int width, int height);

  /// rgb_f32: what the estimator itself gets wrong. One exposure of one second.
  [[nodiscard]] Result<RenderedBracket> ideal() const;
  /// rgb8 with noise and vignetting. One exposure leaves the brightest hundredth saturated; three reach from there to
  /// the peak.
  [[nodiscard]] Result<RenderedBracket> eight_bit(int exposures) const;

 private:
  Camera() = default;
  [[nodiscard]] Result<RenderedBracket> shot(PixelFormat format, const std::vector<double>& radiances) const;

  int width_ = 0, height_ = 0;
  double bright_ = 0, peak_ = 0;
  std::vector<std::vector<float>> radiance_;  ///< By lens.
};

}  // namespace lightwell::eval
