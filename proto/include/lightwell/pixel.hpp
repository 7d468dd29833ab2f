// Pixel formats: names, transfer functions, and conversion to and from linear values.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace lightwell {

enum class PixelFormat : std::uint8_t {
  rgb8,          ///< r, g, b bytes.
  nv12,          ///< Full-size Y plane, then interleaved Cb Cr at half size, same stride. BT.601, limited range.
  yuyv,          ///< Y0 Cb Y1 Cr. BT.601, limited range. V4L2_PIX_FMT_YUYV of a webcam.
  bayer_rggb8,   ///< Bytes; red at the top left.
  bayer_rggb10,  ///< 16-bit little-endian words, the low 10 bits used; red at the top left.
  bayer_rggb12,  ///< 16-bit little-endian words, the low 12 bits used; red at the top left.
  rgb_f32,       ///< r, g, b 32-bit floats: radiance, without saturation or vignetting. HDR images, ideal sensors.
};

inline constexpr std::array kPixelFormats = {
    PixelFormat::rgb8,         PixelFormat::nv12,         PixelFormat::yuyv,   PixelFormat::bayer_rggb8,
    PixelFormat::bayer_rggb10, PixelFormat::bayer_rggb12, PixelFormat::rgb_f32};

[[nodiscard]] constexpr std::string_view to_string(PixelFormat format) {
  constexpr std::string_view kNames[] = {"rgb8", "nv12", "yuyv", "bayer8", "bayer10", "bayer12", "rgb_f32"};
  return format <= kPixelFormats.back() ? kNames[static_cast<std::size_t>(format)] : "unknown";
}

[[nodiscard]] constexpr std::optional<PixelFormat> pixel_format_of(std::string_view name) {
  for (const PixelFormat f : kPixelFormats)
    if (to_string(f) == name) return f;
  return std::nullopt;
}

/// sRGB transfer function (IEC 61966-2-1): the linear value of an sRGB value, both 0 to 1.
[[nodiscard]] inline double srgb_to_linear(double v) {
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}
[[nodiscard]] inline double linear_to_srgb(double x) {
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

/// Gamma-encoded r, g, b (0 to 255) of BT.601 limited-range bytes, rounded; out-of-gamut values are clamped. Integer
/// arithmetic, bit-exact with the SIMD version: products rounded to 1/64 of a code, saturating 16-bit sums.
[[nodiscard]] constexpr std::array<std::uint8_t, 3> rgb8_of_ycbcr601(int y, int cb, int cr) {
  const auto factor = [](double coefficient, int shift) {
    return static_cast<int>(coefficient * 64 * 32768 / (1 << shift) + 0.5);
  };
  const auto product = [](int a, int k) { return (a * k + 0x4000) >> 15; };
  const auto saturated = [](int v) { return v > 32767 ? 32767 : v < -32768 ? -32768 : v; };
  const auto code = [](int v) { return static_cast<std::uint8_t>((v >> 6) < 0 ? 0 : (v >> 6) > 255 ? 255 : v >> 6); };
  const int l = product((y - 16) * 128, factor(1.164384, 7)) + 32, b = (cb - 128) * 256, r = (cr - 128) * 256;
  return {code(saturated(l + product(r, factor(1.596027, 8)))),
          code(saturated(saturated(l - product(b, factor(0.391762, 8))) - product(r, factor(0.812968, 8)))),
          code(saturated(l + product(b, factor(2.017232, 8))))};
}

/// RGB9E5 (OpenGL 4.6 specification, 8.5.2): shared exponent, red in the lowest nine bits. Negative and NaN become 0.
/// Without branches and calls, so that loops vectorise.
[[nodiscard]] inline std::uint32_t rgb9e5_encode(float r, float g, float b) {
  constexpr int kMantissaBits = 9, kBias = 15, kFloatBias = 127, kFloatMantissaBits = 23;
  constexpr float kMaxValue = 65408.0F;  // (2^9 - 1) / 2^9 * 2^(31 - 15)
  const auto clean = [](float v) {
    const float positive = v > 0 ? v : 0.0F;
    return positive < kMaxValue ? positive : kMaxValue;
  };
  const float rc = clean(r), gc = clean(g), bc = clean(b);
  const float larger = rc > gc ? rc : gc, largest = larger > bc ? larger : bc;
  // Subnormal values have an exponent of -127, which the limit replaces.
  const int floor_log2 = (std::bit_cast<std::int32_t>(largest) >> kFloatMantissaBits) - kFloatBias;
  int exponent = (floor_log2 > -kBias - 1 ? floor_log2 : -kBias - 1) + 1 + kBias;
  const auto power_of_two = [](int e) { return std::bit_cast<float>((e + kFloatBias) << kFloatMantissaBits); };
  // Where the largest mantissa would be rounded to 2^9, the next exponent is used; kMaxValue is
  // not rounded up.
  const float rounded = largest * power_of_two(kMantissaBits + kBias - exponent) + 0.5F;
  exponent += rounded >= static_cast<float>(1 << kMantissaBits) ? 1 : 0;
  const float scale = power_of_two(kMantissaBits + kBias - exponent);
  const auto mantissa = [scale](float v) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(v * scale + 0.5F));
  };
  const std::uint32_t code =
      static_cast<std::uint32_t>(exponent) << 27 | mantissa(bc) << 18 | mantissa(gc) << 9 | mantissa(rc);
  return largest > 0 ? code : 0;
}

[[nodiscard]] inline std::array<float, 3> rgb9e5_decode(std::uint32_t v) {
  // 2^(exponent - 15 - 9), of which a float is 23 mantissa bits below its exponent plus 127.
  const float unit = std::bit_cast<float>(((v >> 27) + 127 - 15 - 9) << 23);
  return {static_cast<float>(static_cast<std::int32_t>(v & 511U)) * unit,
          static_cast<float>(static_cast<std::int32_t>(v >> 9 & 511U)) * unit,
          static_cast<float>(static_cast<std::int32_t>(v >> 18 & 511U)) * unit};
}

}  // namespace lightwell
