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

}  // namespace lightwell
