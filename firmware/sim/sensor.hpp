// Sensor model: converts the radiance at each photosite to the bytes of a picture; its noise. Predefined rigs: the
// lenses and sensors of the simulated camera.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "imaging/pixel_layout.hpp"

namespace lightwell::sim {

/// Parameters of a sensor. With the linear value x of calibration/model/response.hpp:
///   x = radiance / radiance_per_unit / white_balance * exposure_s * gain * vignetting(theta)
///   variance of x = gain² read_noise² + gain shot_noise x
///   picture value = response(clamp(black + (1 - black) x, 0, 1)), rounded to the format's levels
/// Full scale at gain 1 is 1 / shot_noise electrons; electron counts are integers.
/// rgb_f32 is the ideal sensor: radiance / radiance_per_unit * exposure_s * gain.
struct SensorModel {
  PixelFormat format = PixelFormat::rgb_f32;
  PhotometricCalibration photometry;
  /// Radiance of full scale in one second at gain 1: the rig's nits_per_unit.
  double radiance_per_unit = 1;
  std::uint64_t seed = 1;
};

/// One exposure of one lens. The noise is a pure function of `frame`, `lens`, the seed and the pixel.
struct Exposure {
  double exposure_s = 1;
  double gain = 1;
  std::uint64_t frame = 0;
  int lens = 0;
};

/// The sensor of one lens, with tables of vignetting and response.
class Sensor {
 public:
  Sensor(const LensParameters& lens, const SensorModel& model);

  [[nodiscard]] std::size_t stride() const { return packed_stride(model_.format, width_); }
  [[nodiscard]] std::size_t bytes() const { return picture_bytes(model_.format, stride(), height_); }

  /// `radiance`: r, g, b per pixel, from LensRays::render(). `out`: bytes() bytes. Allocates two rows of floats.
  void expose(std::span<const float> radiance, const Exposure& exposure, std::span<std::byte> out) const;

 private:
  class RowExposure;

  SensorModel model_;
  int width_, height_;
  std::vector<float> vignetting_;  ///< Per pixel; empty for rgb_f32.
  std::vector<float> response_;    ///< Picture values at evenly spaced linear values.
};

/// Two independent uniform numbers in (0, 1).
struct UniformPair {
  double first = 0, second = 0;
};

/// The noise of one picture, a pure function of seed, frame, lens and pixel, so that results are bit-identical for any
/// number of threads: SplitMix64 (Steele, Lea & Flood 2014, fig. 15) with random access by counter.
class NoiseStream {
 public:
  NoiseStream(std::uint64_t seed, std::uint64_t frame, int lens);

  /// The numbers of one counter, for instance of one channel of a pixel.
  [[nodiscard]] UniformPair at(std::uint64_t counter) const;

 private:
  std::uint64_t key_;
};

/// The standard normal quantile of p in (0, 1), relative error 1e-7 (Wichura 1988, algorithm AS 241, PPND7).
[[nodiscard]] double normal_quantile(double p);

/// The Poisson quantile of p for a mean up to about 100, by summation.
[[nodiscard]] int poisson_quantile(double mean, double p);

inline constexpr std::array<std::string_view, 4> kRigKinds = {"pair", "single", "double_sphere", "equirect"};

/// A rig of the given kind; the picture of each lens is width x height:
///   pair           two Kannala-Brandt lenses of 190 degrees back to back; lens 0 looks along the
///                  probe's -Z, lens 1 along +Z, both pictures upright: +X is right in the first,
///                  left in the second
///   single         only lens 0 of the pair
///   double_sphere  the pair with double sphere lenses
///   equirect       the whole sphere in one picture; height must be width / 2
/// The image circle of a lens lies inside the picture with a margin of 1 %. Both lenses are at the probe's origin,
/// because a panorama is infinitely distant.
///
/// Photometry by format:
///   rgb_f32            ideal; relative units, those of the panorama
///   rgb8, nv12, yuyv   sRGB, mild vignetting, small CMOS noise: 10,000 electrons, 3 read
///   bayer10, bayer12   the same, linear with a black level
/// All except the first are absolute: one unit of the panorama is one cd/m².
///
/// invalid_argument for an unknown kind, with the nearest known one, and for a size that kind or format does not allow.
[[nodiscard]] Result<RigParameters> make_rig(std::string_view kind, int width, int height, PixelFormat format);

/// The sensor that a rig's calibration describes.
[[nodiscard]] SensorModel sensor_of(const RigParameters& rig, PixelFormat format, std::uint64_t seed);

/// The exposure, s, at which `radiance` on the axis is 5 % below saturation at this gain; 1 for rgb_f32.
[[nodiscard]] double exposure_below_saturation(const SensorModel& sensor, double radiance, double gain);

}  // namespace lightwell::sim
