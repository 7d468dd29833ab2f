#include "relight/code_sum.hpp"

namespace lightwell::relight {

void add_codes(const std::uint8_t* __restrict codes, float gain, float* __restrict sums, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto code = static_cast<float>(codes[i]);
    sums[i] += gain * (code * code);
  }
}

void add_codes(const std::uint8_t* __restrict codes, float gain, float constant, const float* __restrict alpha,
               float* __restrict sums, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto code = static_cast<float>(codes[i]);
    sums[i] += (constant + alpha[i]) * gain * (code * code);
  }
}

}  // namespace lightwell::relight
