// The orthonormal discrete cosine transform (DCT-II) of 8 x 8 blocks.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "image_object/block_coder.hpp"

namespace lightwell::image_object {

/// matrix[k][i]: basis function k at sample i.
using DctMatrix = std::array<std::array<float, kBlock>, kBlock>;

[[nodiscard]] inline const DctMatrix& dct_matrix() {
  static const DctMatrix kMatrix = [] {
    DctMatrix m{};
    for (std::size_t k = 0; k < kBlock; ++k)
      for (std::size_t i = 0; i < kBlock; ++i)
        m[k][i] = static_cast<float>(
            std::sqrt((k == 0 ? 1.0 : 2.0) / kBlock) *
            std::cos(std::numbers::pi * (2.0 * static_cast<double>(i) + 1) * static_cast<double>(k) / (2.0 * kBlock)));
    return m;
  }();
  return kMatrix;
}

using BlockValues = std::array<float, kBlockPixels>;

[[nodiscard]] inline BlockValues forward_dct(const BlockValues& in) {
  const DctMatrix& m = dct_matrix();
  BlockValues rows{}, out{};
  for (std::size_t y = 0; y < kBlock; ++y)
    for (std::size_t k = 0; k < kBlock; ++k)
      for (std::size_t x = 0; x < kBlock; ++x) rows[y * kBlock + k] += m[k][x] * in[y * kBlock + x];
  for (std::size_t k = 0; k < kBlock; ++k)
    for (std::size_t y = 0; y < kBlock; ++y)
      for (std::size_t x = 0; x < kBlock; ++x) out[k * kBlock + x] += m[k][y] * rows[y * kBlock + x];
  return out;
}

[[nodiscard]] inline BlockValues inverse_dct(const BlockValues& in) {
  const DctMatrix& m = dct_matrix();
  BlockValues columns{}, out{};
  for (std::size_t y = 0; y < kBlock; ++y)
    for (std::size_t k = 0; k < kBlock; ++k)
      for (std::size_t x = 0; x < kBlock; ++x) columns[y * kBlock + x] += m[k][y] * in[k * kBlock + x];
  for (std::size_t y = 0; y < kBlock; ++y)
    for (std::size_t k = 0; k < kBlock; ++k)
      for (std::size_t x = 0; x < kBlock; ++x) out[y * kBlock + x] += m[k][x] * columns[y * kBlock + k];
  return out;
}

}  // namespace lightwell::image_object
