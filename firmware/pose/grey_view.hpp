// Converts a camera image to the grey picture in which tags are detected.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/calibration.hpp>

#include "imaging/frame.hpp"
#include "pose/grey_picture.hpp"

namespace lightwell {

/// Owns the memory of the grey picture and reuses it for the next one.
class GreyView {
 public:
  /// NV12 and YUYV: luma (NV12 without a copy). RGB: (r + 2 g + b) / 4. Bayer: green, interpolated from the four
  /// neighbours at red and blue sites. Float: the square root of green, with the 99 % quantile as white. Valid until
  /// the next call and as long as the data of `view`. Empty if `view` fails check_view(), or is narrower or
  /// lower than two pixels.
  [[nodiscard]] GreyPicture of(const View& view);

 private:
  std::vector<std::uint8_t> bytes_;
  std::vector<float> sample_;
};

/// Relative linear intensity, 0 to 1, of each of the 256 values that GreyView produces for this format.
[[nodiscard]] std::vector<float> linear_of_grey(PixelFormat format, const PhotometricCalibration& photometry);

}  // namespace lightwell
