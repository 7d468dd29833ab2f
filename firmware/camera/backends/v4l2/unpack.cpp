#include "camera/backends/v4l2/unpack.hpp"

#include <algorithm>
#include <cstring>

namespace lightwell::v4l2 {
namespace {

unsigned value(std::byte b) { return std::to_integer<unsigned>(b); }

/// Value of one pixel, 0 to 1.
double level_at(const View& view, std::size_t x, std::size_t y) {
  const std::span<const std::byte> row = view.data.subspan(y * view.stride);
  const auto word = [&row](std::size_t i) {
    std::uint16_t w = 0;
    std::memcpy(&w, row.data() + 2 * i, sizeof w);
    return static_cast<double>(w);
  };
  switch (view.format) {
    case PixelFormat::rgb8:
      return value(row[3 * x + 1]) / 255.0;
    case PixelFormat::nv12:
    case PixelFormat::bayer_rggb8:
      return value(row[x]) / 255.0;
    case PixelFormat::yuyv:
      return value(row[2 * x]) / 255.0;
    case PixelFormat::bayer_rggb10:
      return word(x) / 1023.0;
    case PixelFormat::bayer_rggb12:
      return word(x) / 4095.0;
    case PixelFormat::rgb_f32:
      return 0;  // Not used by this backend.
  }
  return 0;
}

}  // namespace

void unpack10(std::span<const std::byte> packed, std::span<std::uint16_t> pixels) {
  const std::byte* in = packed.data();
  for (std::size_t i = 0; i + 4 <= pixels.size(); i += 4, in += 5) {
    const unsigned low = value(in[4]);
    pixels[i] = static_cast<std::uint16_t>(value(in[0]) << 2 | (low & 3));
    pixels[i + 1] = static_cast<std::uint16_t>(value(in[1]) << 2 | (low >> 2 & 3));
    pixels[i + 2] = static_cast<std::uint16_t>(value(in[2]) << 2 | (low >> 4 & 3));
    pixels[i + 3] = static_cast<std::uint16_t>(value(in[3]) << 2 | low >> 6);
  }
}

void unpack12(std::span<const std::byte> packed, std::span<std::uint16_t> pixels) {
  const std::byte* in = packed.data();
  for (std::size_t i = 0; i + 2 <= pixels.size(); i += 2, in += 3) {
    const unsigned low = value(in[2]);
    pixels[i] = static_cast<std::uint16_t>(value(in[0]) << 4 | (low & 15));
    pixels[i + 1] = static_cast<std::uint16_t>(value(in[1]) << 4 | low >> 4);
  }
}

void expand_grey(std::span<const std::byte> grey, std::span<std::byte> rgb) {
  std::byte* out = rgb.data();
  for (const std::byte g : grey) {
    out[0] = out[1] = out[2] = g;
    out += 3;
  }
}

double mean_level(const View& view) {
  constexpr std::size_t kGrid = 64;
  const auto width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(view.height);
  const std::size_t columns = std::min(width, kGrid), rows = std::min(height, kGrid);
  double sum = 0;
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns; ++i) {
      // Alternate between odd and even columns, so that all colours of a mosaic are sampled.
      const std::size_t x = std::min(i * width / columns + (j + i) % 2, width - 1);
      const std::size_t y = std::min(j * height / rows + i % 2, height - 1);
      sum += level_at(view, x, y);
    }
  }
  return columns * rows == 0 ? 0 : sum / static_cast<double>(columns * rows);
}

}  // namespace lightwell::v4l2
