// SIMD kernel of projection: sums of rows, each times three weights.
#pragma once

#include <cstddef>

namespace lightwell::estimate {

/// Floats in a row: a multiple of 16, the largest number of lanes.
inline constexpr std::size_t kRowFloats = 112;

/// out[c][i] += sum over k of weights[3 k + c] * rows[k][i], in float; precise for a few hundred rows.
void add_weighted_rows(const float* rows, const float* weights, std::size_t count, float (&out)[3][kRowFloats]);

}  // namespace lightwell::estimate
