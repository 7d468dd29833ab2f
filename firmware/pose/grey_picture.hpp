// A non-owning view of an 8-bit grey picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <lightwell/result.hpp>

namespace lightwell {

/// Rows from the top, `stride` bytes apart. The centre of the top left pixel is (0, 0).
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

}  // namespace lightwell
