// The estimated environment as the frame of a panoramic camera at the plane, so that lights, harmonics and map are
// found as in any panorama.
#pragma once

#include <cstddef>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

#include "estimate/specular/gloss_estimate.hpp"
#include "imaging/frame.hpp"

namespace lightwell::specular {

class EnvironmentPicture {
 public:
  /// Pixels of 1.4 degrees: finer than the cells of a smooth plane (1.5 degrees).
  static constexpr int kWidth = 256, kHeight = 128;

  /// An equirectangular lens that looks along -Z, upright.
  [[nodiscard]] static RigParameters rig();

  /// Fills the pixels: the estimate's radiance above the plane, the plane's own diffuse radiance below it.
  /// `probe_plane`: T_probe_plane, whose rotation is used.
  void render(const GlossEstimate& estimate, const Pose& probe_plane);
  /// Refers to the pixels.
  [[nodiscard]] Frame frame(const FrameInfo& info) const;

 private:
  std::vector<Vec3f> direction_;  ///< By pixel, in the probe's axes.
  std::vector<float> pixels_;     ///< r, g, b.
};

}  // namespace lightwell::specular
