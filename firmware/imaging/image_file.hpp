// Reads image files: PNG and JPEG as 8-bit values, OpenEXR and Radiance HDR as linear floats.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "imaging/pixel_layout.hpp"

namespace lightwell {

/// An image that owns its pixels; rows from the top, without padding. rgb8 from PNG and JPEG, rgb_f32 from EXR and HDR.
struct Image {
  int width = 0, height = 0;
  PixelFormat format = PixelFormat::rgb8;
  std::vector<std::byte> data;

  [[nodiscard]] std::size_t stride() const { return packed_stride(format, width); }
};

/// The content of the file decides its format, not the name. Errors: not_found, data_loss (truncated or damaged),
/// invalid_argument (unknown format, 16 bits per channel, a missing channel).
/// EXR: channels R, G and B, or Y alone; data window and display window must be equal.
[[nodiscard]] Result<Image> read_image(const std::string& path);

/// 8-bit RGB to PNG.
[[nodiscard]] Status write_png(const std::string& path, const Image& image);

}  // namespace lightwell
