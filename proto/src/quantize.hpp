// Block floating point, integers times a common power of two: the wire format of coefficients, irradiances,
// covariances.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace lightwell {

/// Largest magnitude that takes at most two bytes as a zigzag varint.
inline constexpr std::int32_t kMantissaLimit = 8191;

/// The smallest e for which |largest| / 2^e rounds to at most `limit`, which is a power of two minus one; 0 for zero.
[[nodiscard]] inline int exponent_for(float largest, std::int32_t limit = kMantissaLimit) {
  if (!(largest > 0)) return 0;
  int k = 0;
  std::frexp(largest, &k);  // largest = f 2^k with f in [1/2, 1)
  const int e = k - std::bit_width(static_cast<std::uint32_t>(limit));
  return std::nearbyint(std::ldexp(static_cast<double>(largest), -e)) > limit ? e + 1 : e;
}

[[nodiscard]] inline std::int32_t mantissa_of(float value, int exponent) {
  return static_cast<std::int32_t>(std::nearbyint(std::ldexp(static_cast<double>(value), -exponent)));
}

[[nodiscard]] inline float value_of(std::int32_t mantissa, int exponent) {
  return static_cast<float>(std::ldexp(static_cast<double>(mantissa), exponent));
}

}  // namespace lightwell
