// Simulated pictures of a panorama by the cameras of the sweep, as frames.
#pragma once

#include <cstddef>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "imaging/frame.hpp"
#include "sim/scene.hpp"

namespace lightwell::eval {

/// One bracket of a pair of lenses back to back, in contiguous memory.
struct RenderedBracket {
  RigParameters rig;
  PixelFormat format = PixelFormat::rgb8;
  std::vector<double> exposures;
  std::vector<std::byte> bytes;
  std::vector<std::size_t> offsets;  ///< Offset of each picture in `bytes`: by exposure, then by lens.

  /// Frames that refer to `memory`, which has the layout of `bytes`. `number`: index of the capture at 30 per second.
  [[nodiscard]] std::vector<Frame> frames(std::span<const std::byte> memory, std::uint64_t number) const;
};

/// Renders the radiance of a camera's lenses once; exposes it any number of times.
class CameraRenderer {
 public:
  /// Takes about two seconds for 2 x 1280x960.
  [[nodiscard]] static Result<CameraRenderer> make(const sim::Scene& scene, int width, int height);

  /// rgb_f32 without noise, one exposure of one second.
  [[nodiscard]] Result<RenderedBracket> ideal() const;
  /// rgb8 with noise and vignetting. A single exposure saturates the brightest 1 % of the panorama; a bracket ranges
  /// from an exposure for the peak to that one.
  [[nodiscard]] Result<RenderedBracket> eight_bit(int exposures) const;

 private:
  CameraRenderer() = default;
  [[nodiscard]] Result<RenderedBracket> render_bracket(PixelFormat format, const std::vector<double>& radiances) const;

  int width_ = 0, height_ = 0;
  double bright_ = 0, peak_ = 0;
  std::vector<std::vector<float>> radiance_;  ///< By lens.
};

}  // namespace lightwell::eval
