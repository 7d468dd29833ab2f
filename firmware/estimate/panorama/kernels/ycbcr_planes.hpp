// Rows of YCbCr to planes of r, g, b codes, in vectors.
#pragma once

#include <cstddef>
#include <cstdint>

#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

/// Where a row of each plane begins.
struct PlaneRow {
  std::uint8_t *r, *g, *b;
};

/// One row of `pixels` pixels (even, at least kMinLanes) to planes of codes, as rgb8_of_ycbcr601() says.
void planes_of_yuyv(const std::uint8_t* row, std::size_t pixels, const PlaneRow& out);
/// Two rows that share their chroma. Of a single one, luma and planes are given twice.
void planes_of_nv12(const std::uint8_t* upper_luma, const std::uint8_t* lower_luma, const std::uint8_t* chroma,
                    std::size_t pixels, const PlaneRow& upper, const PlaneRow& lower);

}  // namespace lightwell::estimate
