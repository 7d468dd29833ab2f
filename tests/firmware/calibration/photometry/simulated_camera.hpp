// A camera of firmware/sim without vignetting, and what is put in front of it for a calibration.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/pixel.hpp>

#include "calibration/photometry/noise.hpp"
#include "calibration/photometry/picture.hpp"
#include "sim/sensor.hpp"

namespace lightwell::photometry {

class SimulatedCamera {
 public:
  /// A picture of 192x96. Radiance 1 fills the scale in a second at gain 1.
  SimulatedCamera(PixelFormat format, const PhotometricCalibration& photometry, std::uint64_t seed);

  static constexpr int kWidth = 192, kHeight = 96;

  /// `radiance` of a photosite's place, r g b together.
  using Scene = std::function<double(int x, int y)>;
  /// Every picture has noise of its own.
  [[nodiscard]] Picture shoot(const Scene& scene, double exposure_s, double gain = 1);
  [[nodiscard]] std::vector<Picture> darks(int count, double gain = 1);
  /// Two of each level of x, evenly lit.
  [[nodiscard]] std::vector<FlatPair> flats(const std::vector<double>& levels, double gain = 1);

 private:
  PixelFormat format_;
  sim::Sensor sensor_;
  std::uint64_t frame_ = 0;
};

/// What sensors of the test rigs have: 10,000 electrons, 3 read. `format` rgb8: sRGB without black level; Bayer: linear
/// with one.
[[nodiscard]] PhotometricCalibration usual_photometry(PixelFormat format);

/// A wall of small squares whose light goes over three decades in no order.
[[nodiscard]] double shades(int x, int y);

/// Rising, and no gamma: a shoulder and a toe, as cameras for television draw them. Slope at 0: 0.25.
[[nodiscard]] double toe_and_shoulder(double value);

}  // namespace lightwell::photometry
