// A picture of a texture beside its truth, to look at.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "imaging/image_file.hpp"

namespace lightwell::measure {

/// Linear, 1 is white.
struct ComparedTexel {
  std::array<double, 3> truth{}, result{};
};

/// Writes a PNG: truth, result, and `gain` times their difference around grey, side by side. `texel_at(column, row)`
/// returns a ComparedTexel.
template <class TexelAt>
[[nodiscard]] Status write_comparison(const std::string& path, int texels, double gain, const TexelAt& texel_at) {
  const auto edge = static_cast<std::size_t>(texels);
  Image picture{3 * texels, texels, PixelFormat::rgb8, std::vector<std::byte>(9 * edge * edge)};
  const auto set = [&](int column, int row, std::size_t channel, double value) {
    const double code = 255 * std::pow(std::clamp(value, 0.0, 1.0), 1 / 2.2) + 0.5;
    picture.data[static_cast<std::size_t>((row * 3 * texels + column) * 3) + channel] = static_cast<std::byte>(code);
  };
  for (int row = 0; row < texels; ++row)
    for (int column = 0; column < texels; ++column) {
      const ComparedTexel texel = texel_at(column, row);
      for (std::size_t c = 0; c < 3; ++c) {
        set(column, row, c, texel.truth[c]);
        set(texels + column, row, c, texel.result[c]);
        set(2 * texels + column, row, c, 0.5 + gain * (texel.result[c] - texel.truth[c]));
      }
    }
  return write_png(path, picture);
}

}  // namespace lightwell::measure
