// Renders analytic scenes through a rig, and computes the true irradiance of the rendered pixels.
#pragma once

#include <memory>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/lens_table.hpp"
#include "firmware/estimate/extremes/scene.hpp"
#include "imaging/frame.hpp"
#include "reference/vector.hpp"

namespace lightwell::extremes {

/// r, g, b of each pixel, one image per lens. Pixels without solid angle are zero.
using Pictures = std::vector<std::vector<float>>;

/// A frame and its memory.
struct Shot {
  std::vector<std::vector<std::byte>> bytes;
  Frame frame;
};

/// A rig of sim/sensor.hpp; below 16x8, the same lenses with fewer pixels.
[[nodiscard]] RigParameters rig_of(const char* kind, int width, int height, PixelFormat format = PixelFormat::rgb_f32);
/// A lens along -Z that sees this share of the sphere.
[[nodiscard]] RigParameters rig_that_sees(double share, int width, int height);

/// Irradiance at Fibonacci normals as a sum over all pixels, each a patch of uniform radiance.
class PixelTruth {
 public:
  explicit PixelTruth(const RigParameters& rig, int normals = 128);
  [[nodiscard]] const std::vector<reference::V3>& normals() const { return normals_; }
  [[nodiscard]] std::vector<reference::Rgb> irradiance(const Pictures& pictures) const;

 private:
  struct Patch {
    std::size_t lens, pixel;
  };
  std::vector<reference::V3> normals_;
  std::vector<Patch> patches_;
  std::vector<float> x_, y_, z_, solid_angle_;
};

class RigRenderer {
 public:
  explicit RigRenderer(RigParameters rig);

  [[nodiscard]] const RigParameters& rig() const { return rig_; }
  [[nodiscard]] const RigTable& table() const { return table_; }
  /// Side of a pixel of mean solid angle, rad.
  [[nodiscard]] double pixel_rad() const { return pixel_rad_; }
  /// Computed at first use.
  [[nodiscard]] const PixelTruth& truth() const;

  /// Ambient radiance at the middles of pixels; discs by the share of each pixel that they cover.
  [[nodiscard]] Pictures render(const Scene& scene) const;
  void add(const Disc& disc, Pictures& pictures) const;

  [[nodiscard]] Shot as_floats(const Pictures& pictures) const;
  /// Through the simulated sensor with noise. `number` determines the noise.
  [[nodiscard]] Shot as_rgb8(const Pictures& pictures, double exposure_s, std::uint64_t number) const;

 private:
  [[nodiscard]] float covered_share(const Disc& disc, std::size_t lens, int x, int y) const;

  RigParameters rig_;
  RigTable table_;
  std::vector<CameraModel> models_;
  double pixel_rad_ = 0;
  mutable std::shared_ptr<PixelTruth> truth_;
};

}  // namespace lightwell::extremes
