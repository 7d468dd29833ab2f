#include "image_object/view_data.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/color.hpp>

namespace lightwell::image_object {
namespace {

/// Gain of blocks that are nearly black.
constexpr float kMinGain = 0.1F;
/// Largest square root of a base colour, so that damaged input stays finite.
constexpr float kMaxRoot = 1e2F;

}  // namespace

void set_size(DecodedView& view, int columns, int rows) {
  view.columns = columns;
  view.rows = rows;
  view.block_columns = (columns + kBlock - 1) / kBlock;
  view.block_rows = (rows + kBlock - 1) / kBlock;
}

void find_live_blocks(DecodedView& view) {
  view.live.clear();
  const auto blocks = static_cast<std::uint32_t>(view.block_columns * view.block_rows);
  for (std::uint32_t block = 0; block < blocks; ++block) {
    bool covered = false;
    each_pixel(view, block, [&](std::size_t pixel, std::size_t) { covered |= view.coverage[pixel] != 0; });
    if (covered) view.live.push_back(block);
  }
}

void base_pixels(const BasePlanes& planes, std::span<BasePixel, kBlockPixels> out) {
  const auto square = [](float root) {
    const float limited = std::clamp(root, 0.0F, kMaxRoot);
    return limited * limited;
  };
  for (std::size_t i = 0; i < kBlockPixels; ++i) {
    const float rest = planes[0][i] - planes[2][i];
    BasePixel& p = out[i];
    p.base = {square(rest + planes[1][i]), square(planes[0][i] + planes[2][i]), square(rest - planes[1][i])};
    // Green of luminance 1.
    const float r = std::clamp(planes[3][i], -kMaxRoot, kMaxRoot), b = std::clamp(planes[4][i], -kMaxRoot, kMaxRoot);
    const float g = -(kLuminanceWeights[0] * r + kLuminanceWeights[2] * b) / kLuminanceWeights[1];
    p.second = Radiance{1 + r, 1 + g, 1 + b} * p.base.luminance();
  }
}

float gain_of(const DecodedView& view, std::uint32_t block, std::span<const BasePixel, kBlockPixels> base) {
  float sum = 0, weight = 0;
  each_pixel(view, block, [&](std::size_t pixel, std::size_t place) {
    const auto share = static_cast<float>(view.coverage[pixel]);
    sum += share * base[place].base.luminance();
    weight += share;
  });
  return std::max(kMinGain, std::sqrt(weight > 0 ? sum / weight : 0));
}

}  // namespace lightwell::image_object
