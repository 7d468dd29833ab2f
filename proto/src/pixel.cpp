#include <algorithm>

#include <lightwell/pixel.hpp>

namespace lightwell {

std::uint32_t rgb9e5_encode(float r, float g, float b) {
  constexpr int kMantissaBits = 9, kBias = 15, kMaxExponent = 31;
  static constexpr float kMaxValue = 65408.0F;  // (2^9 - 1) / 2^9 * 2^(31 - 15)
  const auto clean = [](float v) { return v > 0 ? std::min<float>(v, kMaxValue) : 0.0F; };
  const float rc = clean(r), gc = clean(g), bc = clean(b);
  const float largest = std::max({rc, gc, bc});
  if (!(largest > 0)) return 0;
  int exponent = std::max(-kBias - 1, std::ilogb(largest)) + 1 + kBias;
  float unit = std::ldexp(1.0F, exponent - kBias - kMantissaBits);
  if (std::floor(largest / unit + 0.5F) >= static_cast<float>(1 << kMantissaBits)) {
    unit *= 2;
    ++exponent;
  }
  exponent = std::min(exponent, kMaxExponent);
  const auto mantissa = [&](float v) { return static_cast<std::uint32_t>(std::floor(v / unit + 0.5F)); };
  return static_cast<std::uint32_t>(exponent) << 27 | mantissa(bc) << 18 | mantissa(gc) << 9 | mantissa(rc);
}

std::array<float, 3> rgb9e5_decode(std::uint32_t v) {
  const float unit = std::ldexp(1.0F, static_cast<int>(v >> 27) - 15 - 9);
  return {static_cast<float>(v & 511U) * unit, static_cast<float>(v >> 9 & 511U) * unit,
          static_cast<float>(v >> 18 & 511U) * unit};
}

}  // namespace lightwell
