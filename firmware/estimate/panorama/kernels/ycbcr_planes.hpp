// Rows of YCbCr to planes of r, g, b codes, in vectors.
#pragma once

#include <cstddef>
#include <cstdint>

#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

/// One row of `pixels` pixels (even, at least kFewestLanes) to three planes of codes, as rgb8_of_ycbcr601() says.
void planes_of_yuyv(const std::uint8_t* row, std::size_t pixels, std::uint8_t* r, std::uint8_t* g, std::uint8_t* b);
void planes_of_nv12(const std::uint8_t* luma, const std::uint8_t* chroma, std::size_t pixels, std::uint8_t* r,
                    std::uint8_t* g, std::uint8_t* b);

}  // namespace lightwell::estimate
