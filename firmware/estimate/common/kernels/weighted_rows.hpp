// The vector kernel of projection: a sum of rows of numbers, each by three weights.
#pragma once

#include <cstddef>

namespace lightwell::estimate {

/// Numbers in a row: a multiple of 16, so that every vector divides it.
inline constexpr std::size_t kRowFloats = 112;

/// out[c][i] += sum over k of weights[3 k + c] * rows[k][i], in float: for a few hundred rows at a time.
void add_weighted_rows(const float* rows, const float* weights, std::size_t count, float (&out)[3][kRowFloats]);

}  // namespace lightwell::estimate
