// Still pictures from files: PNG and JPEG as bytes, OpenEXR and Radiance HDR as linear floats.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A picture that owns its pixels, rows packed from the top: rgb8 for PNG and JPEG, rgb_f32 for EXR and HDR
/// (the values of the file, untouched).
struct Image {
  int width = 0, height = 0;
  PixelFormat format = PixelFormat::rgb8;
  std::vector<std::byte> data;

  [[nodiscard]] std::size_t stride() const { return packed_stride(format, width); }
};

/// By the file's content, not its name. not_found, data_loss (truncated or damaged, with the reader's own words),
/// invalid_argument (a kind that is not known, 16 bits, a channel missing).
/// EXR: channels R, G, B, or Y alone; the data window is taken, a display window that differs is refused.
[[nodiscard]] Result<Image> read_image(const std::string& path);

/// 8-bit RGB to PNG.
[[nodiscard]] Status write_png(const std::string& path, const Image& image);

}  // namespace lightwell
