// A grey picture that somebody else owns.
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

  /// invalid_argument where the bytes do not hold the picture, or it is empty or beyond 16,384 pixels a side.
  [[nodiscard]] Status validate() const;
};

/// The least contrast that is more than noise, for TagDetector: from by how much values differ within windows of 12 x
/// 12 pixels all over the picture, those that are rather flat. 5 (a clean picture) to 15; takes 20 us.
[[nodiscard]] int contrast_above_noise(const GreyPicture& picture);

}  // namespace lightwell
