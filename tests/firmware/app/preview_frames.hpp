// Frames of two colours in every pixel format, for tests of previews.
#pragma once

#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "firmware/app/fakes.hpp"
#include "imaging/frame.hpp"

namespace lightwell::test {

/// Codes of a colour: r, g, b as fractions of full scale, and Y, Cb, Cr of BT.601 with limited range.
struct FrameColor {
  std::array<float, 3> rgb;
  std::array<int, 3> ycbcr;
};
inline constexpr FrameColor kRed{{1, 0, 0}, {81, 90, 240}}, kBlue{{0, 0, 1}, {41, 240, 110}},
    kBlack{{0, 0, 0}, {16, 128, 128}}, kWhite{{1, 1, 1}, {235, 128, 128}};

/// A picture whose columns are colored by `color_of(x)`, with padded rows.
struct ColumnPicture {
  int lens = 0;
  PixelFormat format;
  int width, height;
  std::size_t stride;
  std::vector<std::byte> data;

  template <class ColorOf>
  ColumnPicture(PixelFormat of, int w, int h, const ColorOf& color_of, float float_scale = 1)
      : format(of),
        width(w),
        height(h),
        stride(packed_stride(of, w) + 16),
        data(picture_bytes(of, stride, h), std::byte{0xAA}) {
    const PixelLayout& layout = pixel_layout(of);
    const auto put = [&](int row, std::size_t column, unsigned value) {
      std::byte* at = data.data() + static_cast<std::size_t>(row) * stride + column * layout.sample_bytes;
      at[0] = static_cast<std::byte>(value & 255);
      if (layout.sample_bytes == 2) at[1] = static_cast<std::byte>(value >> 8);
    };
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        const FrameColor color = color_of(x);
        const auto column = static_cast<std::size_t>(x);
        const auto code = [&](std::size_t c) {
          return static_cast<unsigned>(color.rgb[c] * static_cast<float>(layout.full_scale()) + 0.5F);
        };
        const auto yuv = [&](std::size_t c) { return static_cast<unsigned>(color.ycbcr[c]); };
        switch (layout.sampling) {
          case ColorSampling::rgb:
            for (std::size_t c = 0; c < 3; ++c) {
              if (!layout.is_float()) {
                put(y, 3 * column + c, code(c));
                continue;
              }
              const float v = color.rgb[c] * float_scale;
              std::memcpy(data.data() + static_cast<std::size_t>(y) * stride + 12 * column + 4 * c, &v, sizeof v);
            }
            break;
          case ColorSampling::rggb:
            put(y, column, code(static_cast<std::size_t>((x & 1) + (y & 1))));
            break;
          case ColorSampling::ycbcr: {
            const std::size_t chroma = x % 2 == 0 ? 1 : 2;
            if (of == PixelFormat::nv12) {
              put(y, column, yuv(0));
              put(h + y / 2, column, yuv(chroma));
            } else {
              put(y, 2 * column, yuv(0));
              put(y, 2 * column + 1, yuv(chroma));
            }
            break;
          }
        }
      }
  }
  [[nodiscard]] View view() const { return {lens, format, width, height, stride, data}; }
};

/// A rig of lenses with linear response; no other member matters to previews.
[[nodiscard]] inline RigParameters preview_rig(int lenses, int width, int height) {
  RigParameters rig;
  rig.lenses.resize(static_cast<std::size_t>(lenses));
  for (LensParameters& lens : rig.lenses) {
    lens.width = width;
    lens.height = height;
  }
  return rig;
}

}  // namespace lightwell::test
