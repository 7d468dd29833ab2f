// A simulated camera (firmware/sim) without vignetting, and scenes for calibration tests.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/pixel.hpp>

#include "calibration/solve/photometry/noise.hpp"
#include "calibration/solve/photometry/picture.hpp"
#include "sim/sensor.hpp"

namespace lightwell::photometry {

class SimulatedCamera {
 public:
  /// Pictures of 192x96. Radiance 1 gives full scale in 1 s at gain 1.
  SimulatedCamera(PixelFormat format, const PhotometricCalibration& photometry, std::uint64_t seed);

  static constexpr int kWidth = 192, kHeight = 96;

  /// Radiance at a photosite, equal for r, g, b.
  using Scene = std::function<double(int x, int y)>;
  /// Takes a picture; each has different noise.
  [[nodiscard]] Picture shoot(const Scene& scene, double exposure_s, double gain = 1);
  [[nodiscard]] std::vector<Picture> darks(int count, double gain = 1);
  /// A pair of uniform pictures for each level of x.
  [[nodiscard]] std::vector<FlatPair> flats(const std::vector<double>& levels, double gain = 1);

 private:
  PixelFormat format_;
  sim::Sensor sensor_;
  std::uint64_t frame_ = 0;
};

/// Photometry of the predefined rigs: full well 10,000 electrons, read noise 3. `format` rgb8: sRGB without black
/// level; Bayer: linear with one.
[[nodiscard]] PhotometricCalibration usual_photometry(PixelFormat format);

/// A pattern of small squares with radiance over three decades in irregular order.
[[nodiscard]] double shades(int x, int y);

/// An increasing curve with toe and shoulder, like those of television cameras, which is not a gamma curve. Slope at 0:
/// 0.25.
[[nodiscard]] double toe_and_shoulder(double value);

}  // namespace lightwell::photometry
