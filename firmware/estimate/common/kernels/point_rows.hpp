// The vector kernel of light at single directions: the functions of a BasisRow are worked out for a vector of
// directions at a time.
#pragma once

#include <array>
#include <cstddef>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// Light from single directions. Those beyond `count` give none, and are finite.
struct LightPoints {
  static constexpr std::size_t kMaxPoints = 128;
  std::size_t count = 0;
  alignas(64) std::array<float, kMaxPoints> x{}, y{}, z{};  ///< Unit vectors.
  alignas(64) std::array<float, kMaxPoints> r{}, g{}, b{};
};

/// out[c][i] += sum over the points of light c times function i of a BasisRow, in float: within 2e-6 of the largest
/// function times the sum of amounts.
void add_points(const LightPoints& points, float (&out)[3][kRowCount]);

}  // namespace lightwell::estimate
