// The table of pixel formats: memory layout, colour sampling and codes of each PixelFormat.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <lightwell/pixel.hpp>

namespace lightwell {

/// How samples represent colour.
enum class ColorSampling : std::uint8_t {
  rgb,    ///< Red, green and blue of each pixel, interleaved.
  ycbcr,  ///< Luma of each pixel, one pair of Cb and Cr per unit.
  rggb,   ///< Bayer mosaic: one sample per pixel. A unit has red at the top left, blue at the bottom right.
};

/// Bit depths of the formats with codes. Lookup tables by code exist once for each.
inline constexpr std::array kCodeBits = {8, 10, 12};

/// A row of the table. The planes of a picture have the same stride and follow one another without a gap.
/// A code c is the picture value c / full_scale(). The black level is a property of the camera and not of the format:
/// a fraction of full scale (PhotometricCalibration), which is subtracted from the linear value. YCbCr of limited range
/// is converted to codes of r, g, b first (rgb8_of_ycbcr601()). Floats are radiance, without black level or saturation.
struct PixelLayout {
  PixelFormat format;
  ColorSampling sampling;
  int bits;                     ///< Of a code, in the lowest bits of its sample; 0: samples are floats.
  std::size_t sample_bytes;     ///< Of a sample, little-endian. Rows and pictures are aligned to it.
  std::size_t pixel_bytes;      ///< Per pixel of the width in a row, in each plane.
  std::size_t luma_offset;      ///< Bytes from the start of a pixel to its luma or green; 0 in a mosaic.
  int unit_width, unit_height;  ///< Pixels that share one colour. Width and height of a picture are multiples of it.
  std::size_t planes;           ///< 2: luma, then Cb Cr with a row for every unit_height rows of luma.

  [[nodiscard]] constexpr bool is_float() const { return bits == 0; }
  /// Number of codes; 1 for floats.
  [[nodiscard]] constexpr int levels() const { return 1 << bits; }
  /// The largest code; 0 for floats.
  [[nodiscard]] constexpr int full_scale() const { return levels() - 1; }
  /// Index of `bits` in kCodeBits; 0 for floats.
  [[nodiscard]] constexpr std::size_t depth_index() const {
    std::size_t i = kCodeBits.size() - 1;
    while (i > 0 && kCodeBits[i] != bits) --i;
    return i;
  }
};

/// In the order of kPixelFormats.
inline constexpr std::array kPixelLayouts = {
    // format, sampling, bits, sample_bytes, pixel_bytes, luma_offset, unit_width, unit_height, planes
    PixelLayout{PixelFormat::rgb8, ColorSampling::rgb, 8, 1, 3, 1, 1, 1, 1},
    PixelLayout{PixelFormat::nv12, ColorSampling::ycbcr, 8, 1, 1, 0, 2, 2, 2},
    PixelLayout{PixelFormat::yuyv, ColorSampling::ycbcr, 8, 1, 2, 0, 2, 1, 1},
    PixelLayout{PixelFormat::bayer_rggb8, ColorSampling::rggb, 8, 1, 1, 0, 2, 2, 1},
    PixelLayout{PixelFormat::bayer_rggb10, ColorSampling::rggb, 10, 2, 2, 0, 2, 2, 1},
    PixelLayout{PixelFormat::bayer_rggb12, ColorSampling::rggb, 12, 2, 2, 0, 2, 2, 1},
    PixelLayout{PixelFormat::rgb_f32, ColorSampling::rgb, 0, 4, 12, 4, 1, 1, 1},
};

[[nodiscard]] constexpr const PixelLayout& pixel_layout(PixelFormat format) {
  return kPixelLayouts[static_cast<std::size_t>(format)];
}

static_assert(
    [] {
      if (kPixelLayouts.size() != kPixelFormats.size()) return false;
      for (const PixelFormat format : kPixelFormats)
        if (pixel_layout(format).format != format) return false;
      return true;
    }(),
    "kPixelLayouts has a row for each format of kPixelFormats, in the order of the enumerators");

/// Whether a picture of this format can have this size: positive, and whole units.
[[nodiscard]] constexpr bool size_fits(PixelFormat format, int width, int height) {
  const PixelLayout& layout = pixel_layout(format);
  return width > 0 && height > 0 && width % layout.unit_width == 0 && height % layout.unit_height == 0;
}

/// Bytes per row without padding.
[[nodiscard]] constexpr std::size_t packed_stride(PixelFormat format, int width) {
  return pixel_layout(format).pixel_bytes * static_cast<std::size_t>(width);
}

/// Bytes of a whole picture, all planes.
[[nodiscard]] constexpr std::size_t picture_bytes(PixelFormat format, std::size_t stride, int height) {
  const PixelLayout& layout = pixel_layout(format);
  return stride * (static_cast<std::size_t>(height) +
                   (layout.planes - 1) * static_cast<std::size_t>(height / layout.unit_height));
}

[[nodiscard]] constexpr bool is_bayer(PixelFormat format) {
  return pixel_layout(format).sampling == ColorSampling::rggb;
}

/// MIPI CSI-2 RAW10 (specification 11.4.4; V4L2's 10P): four bytes with the upper eight bits, then one with the lower
/// two of each, the first pixel's in its lowest bits. `pixels.size()` is a multiple of 4; `packed` has 5/4 as many
/// bytes.
inline void unpack10(std::span<const std::byte> packed, std::span<std::uint16_t> pixels) {
  const std::byte* in = packed.data();
  for (std::size_t i = 0; i + 4 <= pixels.size(); i += 4, in += 5) {
    const unsigned low = std::to_integer<unsigned>(in[4]);
    pixels[i] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[0]) << 2 | (low & 3));
    pixels[i + 1] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[1]) << 2 | (low >> 2 & 3));
    pixels[i + 2] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[2]) << 2 | (low >> 4 & 3));
    pixels[i + 3] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[3]) << 2 | low >> 6);
  }
}

/// MIPI CSI-2 RAW12 (11.4.5; V4L2's 12P): two bytes with the upper eight bits, then one with the lower four of each,
/// the first pixel's in its lowest bits. `pixels.size()` is a multiple of 2; `packed` has 3/2 as many bytes.
inline void unpack12(std::span<const std::byte> packed, std::span<std::uint16_t> pixels) {
  const std::byte* in = packed.data();
  for (std::size_t i = 0; i + 2 <= pixels.size(); i += 2, in += 3) {
    const unsigned low = std::to_integer<unsigned>(in[2]);
    pixels[i] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[0]) << 4 | (low & 15));
    pixels[i + 1] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[1]) << 4 | low >> 4);
  }
}

}  // namespace lightwell
