#include "camera/backends/v4l2/unpack.hpp"

#include <algorithm>

namespace lightwell::v4l2 {
namespace {

unsigned value(std::byte b) { return std::to_integer<unsigned>(b); }

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
  const double full_scale = pixel_layout(view.format).full_scale();
  double sum = 0;
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns; ++i) {
      // Alternate between odd and even columns, so that all colours of a mosaic are sampled.
      const std::size_t x = std::min(i * width / columns + (j + i) % 2, width - 1);
      const std::size_t y = std::min(j * height / rows + i % 2, height - 1);
      sum += code_at(view, static_cast<int>(x), static_cast<int>(y)) / full_scale;
    }
  }
  return columns * rows == 0 ? 0 : sum / static_cast<double>(columns * rows);
}

}  // namespace lightwell::v4l2
