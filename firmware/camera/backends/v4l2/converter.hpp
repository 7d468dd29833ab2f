// Converts a driver's buffer to a picture in a PixelFormat.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "camera/backends/v4l2/formats.hpp"
#include "camera/backends/v4l2/jpeg_decoder.hpp"

namespace lightwell::v4l2 {

/// Not thread-safe.
class Converter {
 public:
  Converter(const Encoding& encoding, const Layout& layout);

  /// `picture` has layout.picture_bytes. False if `driver` does not contain a complete picture; `picture` may then be
  /// partly written.
  [[nodiscard]] bool convert(std::span<const std::byte> driver, std::span<std::byte> picture);

 private:
  void convert_row(std::span<const std::byte> in, std::span<std::byte> out) const;

  Encoding encoding_;
  Layout layout_;
  std::optional<JpegDecoder> jpeg_;
};

}  // namespace lightwell::v4l2
