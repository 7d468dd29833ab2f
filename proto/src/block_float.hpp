// Block floating point, integers times a common power of two: the wire format of coefficients, irradiances and
// covariances.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace lightwell {

/// Range of the exponents on the wire. Every float is a multiple of 2^-150.
inline constexpr int kMinBlockExponent = -150, kMaxBlockExponent = 100;

/// The smallest e from kMinBlockExponent up for which `largest` / 2^e rounds to at most `limit`, which is a power of
/// two minus one; 0 for zero. May exceed kMaxBlockExponent.
[[nodiscard]] inline int exponent_for(double largest, std::int32_t limit) {
  if (!(largest > 0)) return 0;
  int k = 0;
  std::frexp(largest, &k);  // largest = f 2^k with f in [1/2, 1)
  const int e = k - std::bit_width(static_cast<std::uint32_t>(limit));
  return std::max(std::nearbyint(std::ldexp(largest, -e)) > limit ? e + 1 : e, kMinBlockExponent);
}

[[nodiscard]] inline std::int32_t mantissa_of(float value, int exponent) {
  return static_cast<std::int32_t>(std::nearbyint(std::ldexp(static_cast<double>(value), -exponent)));
}

[[nodiscard]] inline float value_of(std::int32_t mantissa, int exponent) {
  return static_cast<float>(std::ldexp(static_cast<double>(mantissa), exponent));
}

}  // namespace lightwell
