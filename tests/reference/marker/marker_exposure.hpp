// From the radiance of a picture to a camera's bytes.
//   expose, expose_grey, to_grey
#pragma once

#include <cstdint>
#include <vector>

#include "pose/grey_picture.hpp"
#include "reference/marker/marker_picture.hpp"

namespace lightwell::reference {

struct ExposureOptions {
  double full_scale = 1;            ///< Radiance that fills the scale; more is clipped.
  double electrons = 10'000;        ///< That fill the scale; 0: no shot noise.
  double read_noise_electrons = 3;  ///< Standard deviation. Without `electrons` there is none.
  bool srgb = false;                ///< Encoded; otherwise linear.
  std::uint64_t seed = 1;
  std::uint64_t frame = 0;  ///< Another number is another noise.
};

/// r g b a pixel, rows packed.
struct BytePicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

struct GreyBytes {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;

  [[nodiscard]] GreyPicture view() const;
};

/// A colour camera, by lightwell::sim::Sensor: noise of each channel by itself, no vignetting, no mosaic.
[[nodiscard]] BytePicture expose(const RadiancePicture& picture, const ExposureOptions& options = {});
/// A camera without colour: its one channel sees the Rec. 709 luminance.
[[nodiscard]] GreyBytes expose_grey(const RadiancePicture& picture, const ExposureOptions& options = {});
/// Rec. 709 weights on bytes as they are (of an encoded picture: luma), rounded.
[[nodiscard]] GreyBytes to_grey(const BytePicture& picture);

}  // namespace lightwell::reference
