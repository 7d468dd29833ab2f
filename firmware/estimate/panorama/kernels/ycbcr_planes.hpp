// SIMD kernels that convert rows of YCbCr to planes of r, g, b codes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

/// Pointers to a row of each plane.
struct PlaneRow {
  std::uint8_t *r, *g, *b;
};

/// Converts one row of `pixels` pixels (even, at least kMinLanes) as rgb8_of_ycbcr601() does.
void planes_of_yuyv(const std::uint8_t* row, std::size_t pixels, const PlaneRow& out);
/// Converts two rows that share their chroma. For a single row, pass its luma and planes twice.
void planes_of_nv12(const std::uint8_t* upper_luma, const std::uint8_t* lower_luma, const std::uint8_t* chroma,
                    std::size_t pixels, const PlaneRow& upper, const PlaneRow& lower);

}  // namespace lightwell::estimate
