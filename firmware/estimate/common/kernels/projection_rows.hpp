// SIMD kernels that project cells and point lights onto spherical harmonics.
#pragma once

#include <array>
#include <cstddef>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// `rows`: `count` BasisRows. out[c][i] += sum over k of weights[3 k + c] * rows[k][i], in float; precise for a few
/// hundred rows.
void add_weighted_rows(const float* rows, const float* weights, std::size_t count, float (&out)[3][kRowCount]);

/// Point lights. Elements beyond `count` must be finite and are ignored.
struct LightPoints {
  static constexpr std::size_t kMaxPoints = 128;
  std::size_t count = 0;
  alignas(64) std::array<float, kMaxPoints> x{}, y{}, z{};  ///< Unit vectors.
  alignas(64) std::array<float, kMaxPoints> r{}, g{}, b{};
};

/// out[c][i] += sum over the points of channel c times basis function i of a BasisRow, in float. Error: at most 2e-6 of
/// the largest basis function times the sum of absolute values.
void add_points(const LightPoints& points, float (&out)[3][kRowCount]);

}  // namespace lightwell::estimate
