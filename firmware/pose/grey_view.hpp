// The grey picture in which tags are detected, and the conversion of a camera image to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "imaging/frame.hpp"

namespace lightwell {

/// A view of an 8-bit grey picture: rows from the top, `stride` bytes apart. The centre of the first pixel is (0, 0).
struct GreyPicture {
  std::span<const std::uint8_t> data;
  int width = 0, height = 0;
  std::size_t stride = 0;

  [[nodiscard]] std::uint8_t at(int x, int y) const {
    return data[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x)];
  }

  /// invalid_argument: too few bytes for the size and stride, an empty picture, or more than 16,384 pixels per side.
  [[nodiscard]] Status validate() const;
};

/// Estimates the noise of a picture as a contrast threshold for TagDetector: from the 40 % quantile of the ranges (max
/// - min) of windows of 12 x 12 pixels all over the picture, with a margin. 5 (a clean picture) to 15; takes 20 us.
[[nodiscard]] int contrast_above_noise(const GreyPicture& picture);

/// Owns the memory of the grey picture and reuses it for the next one.
class GreyView {
 public:
  /// NV12 and YUYV: luma (NV12 without a copy). RGB: (r + 2 g + b) / 4. Bayer: green, interpolated from the four
  /// neighbours at red and blue sites. Float: the square root of green, with the 99 % quantile as white. Valid until
  /// the next call and as long as the data of `view`. Empty if `view` is invalid or below two pixels.
  [[nodiscard]] GreyPicture of(const View& view);

 private:
  std::vector<std::uint8_t> bytes_;
  std::vector<float> sample_;
};

/// Relative linear intensity, 0 to 1, of each of the 256 values that GreyView produces for this format.
[[nodiscard]] std::vector<float> linear_of_grey(PixelFormat format, const PhotometricCalibration& photometry);

}  // namespace lightwell
