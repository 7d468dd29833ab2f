// SIMD kernel that projects point lights onto spherical harmonics, a vector of directions at a time.
#pragma once

#include <array>
#include <cstddef>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

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
