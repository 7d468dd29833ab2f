// Simulated exposure: from the radiance of an image to a camera's bytes.
//   expose, expose_grey, to_grey
#pragma once

#include <cstdint>
#include <vector>

#include "pose/grey_view.hpp"
#include "reference/marker/marker_picture.hpp"

namespace lightwell::reference {

struct ExposureOptions {
  double full_scale = 1;            ///< Radiance at full scale; more is clipped.
  double electrons = 10'000;        ///< At full scale; 0: no noise.
  double read_noise_electrons = 3;  ///< Standard deviation; ignored if `electrons` is 0.
  bool srgb = false;                ///< sRGB encoding; otherwise linear.
  std::uint64_t seed = 1;
  std::uint64_t frame = 0;  ///< Frame number; each has different noise.
};

/// Three bytes per pixel, packed rows.
struct BytePicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

struct GreyBytes {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;

  [[nodiscard]] GreyPicture view() const;
};

/// A colour camera by lightwell::sim::Sensor: independent noise per channel, no vignetting, no mosaic.
[[nodiscard]] BytePicture expose(const RadiancePicture& picture, const ExposureOptions& options = {});
/// A monochrome camera; its channel is the Rec. 709 luminance.
[[nodiscard]] GreyBytes expose_grey(const RadiancePicture& picture, const ExposureOptions& options = {});
/// Rec. 709 weights applied to the bytes as they are (luma for an encoded image), rounded.
[[nodiscard]] GreyBytes to_grey(const BytePicture& picture);

}  // namespace lightwell::reference
