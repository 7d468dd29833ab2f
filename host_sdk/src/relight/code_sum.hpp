// Sums of photographs as their codes, vectorised by the compiler.
#pragma once

#include <cstddef>
#include <cstdint>

namespace lightwell::relight {

/// sums[i] += gain codes[i]^2.
void add_codes(const std::uint8_t* codes, float gain, float* sums, std::size_t count);
/// sums[i] += (constant + alpha[i]) gain codes[i]^2.
void add_codes(const std::uint8_t* codes, float gain, float constant, const float* alpha, float* sums,
               std::size_t count);

}  // namespace lightwell::relight
