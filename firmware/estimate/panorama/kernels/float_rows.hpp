// SIMD kernel of BlockPass for float images.
#pragma once

#include <cstddef>

namespace lightwell::estimate {

/// Sums over the rows of a row of blocks, one element per column of pixels.
struct FloatColumns {
  float *r, *g, *b;  ///< Radiance times solid angle.
  float* low;        ///< Luminance times solid angle times the row's depth.
  float* peak;       ///< Largest luminance of a pixel with solid angle.
};

/// Adds a run of `pixels` pixels (three floats r, g, b each, at any alignment) times `scale`. Adds nothing and returns
/// false where a value is NaN or not in [0, max_radiance].
[[nodiscard]] bool add_float_row(const std::byte* rgb, const float* solid_angle, std::size_t pixels, float scale,
                                 float max_radiance, float depth, const FloatColumns& out);

}  // namespace lightwell::estimate
