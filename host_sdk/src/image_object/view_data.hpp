// A decoded view: the values that relighting reads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

#include "image_object/block_coder.hpp"

namespace lightwell::image_object {

/// A transform coefficient that is not zero.
struct Coefficient {
  std::uint16_t where = 0;  ///< plane * 64 + position in the block; ObjectRig::kMaxLights planes at most.
  std::int16_t level = 0;
};

/// Functions of the light's position and their coefficients: the square root of a luminance (of a negative one, minus
/// that of its magnitude) is the sum over planes of basis(plane, position) times the inverse transform of the plane's
/// levels times step / gain of the block.
struct LightPlanes {
  std::size_t planes = 0;
  float step = 0;
  std::vector<float> basis;   ///< [plane * lights + light].
  std::vector<bool> precise;  ///< Of each plane: whether its basis is stored with 16 bits; otherwise 8.
  /// Of live block i: coefficients[begin[i]] to coefficients[begin[i + 1]] (excluded).
  std::vector<std::uint32_t> begin;
  std::vector<Coefficient> coefficients;
};

/// Colours of one pixel of a live block, linear, both of the same luminance.
struct BasePixel {
  Radiance base, second;
};

struct DecodedView {
  int columns = 0, rows = 0;
  int block_columns = 0, block_rows = 0;
  float turn_rad = 0;
  std::vector<Vec3f> directions;  ///< Unit, towards the lights, in the frame of the rig.
  float reference_irradiance = 1;
  std::vector<std::uint8_t> coverage;  ///< columns * rows.
  std::vector<std::uint32_t> live;     ///< Blocks that the object covers, row * block_columns + column, ascending.
  std::vector<float> gain;             ///< Of each live block: square root of its mean base luminance.
  std::vector<BasePixel> base;         ///< 64 of each live block.
  LightPlanes luminance, highlight;
};

/// Sets block_columns and block_rows.
void set_size(DecodedView& view, int columns, int rows);
/// Sets `live` from the coverage.
void find_live_blocks(DecodedView& view);

/// Calls use(pixel of the picture, place in the block) for the pixels of a block that lie in the picture.
template <class Use>
void each_pixel(const DecodedView& view, std::uint32_t block, const Use& use) {
  const int left = static_cast<int>(block) % view.block_columns * kBlock;
  const int top = static_cast<int>(block) / view.block_columns * kBlock;
  for (int y = 0; y < kBlock && top + y < view.rows; ++y)
    for (int x = 0; x < kBlock && left + x < view.columns; ++x)
      use(static_cast<std::size_t>(top + y) * static_cast<std::size_t>(view.columns) +
              static_cast<std::size_t>(left + x),
          static_cast<std::size_t>(y * kBlock + x));
}

inline constexpr std::size_t kBasePlanes = 5;

/// Of a block: square root of the base colour in three planes (YCoCg; Malvar & Sullivan 2003), red and blue of the
/// second chromaticity minus 1.
using BasePlanes = std::array<std::array<float, kBlockPixels>, kBasePlanes>;
/// Steps of the planes relative to ObjectEncoderOptions::base_step.
inline constexpr std::array<float, kBasePlanes> kBaseSteps = {1, 1.5F, 1.5F, 4, 4};

/// The linear colours of decoded planes.
void base_pixels(const BasePlanes& planes, std::span<BasePixel, kBlockPixels> out);

/// Gain of a block, from its base.
[[nodiscard]] float gain_of(const DecodedView& view, std::uint32_t block,
                            std::span<const BasePixel, kBlockPixels> base);

}  // namespace lightwell::image_object
