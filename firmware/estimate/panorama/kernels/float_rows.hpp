// The vector kernel of BlockPass for pictures of floats.
#pragma once

#include <cstddef>

namespace lightwell::estimate {

/// Sums over the rows of a row of blocks, a number a column of pixels.
struct FloatColumns {
  float *r, *g, *b;  ///< Radiance times solid angle.
  float* low;        ///< Luminance times solid angle times the row's depth.
  float* peak;       ///< Largest luminance of a pixel with solid angle.
};

/// Adds a run of `pixels` of r, g, b (three floats each, at any alignment) times `scale`. False, and nothing is added,
/// where one of them is not within 0 and `brightest`: NaN is not.
[[nodiscard]] bool add_float_row(const std::byte* rgb, const float* solid_angle, std::size_t pixels, float scale,
                                 float brightest, float depth, const FloatColumns& out);

}  // namespace lightwell::estimate
