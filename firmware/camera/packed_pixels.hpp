// Unpacks rows of packed raw pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace lightwell {

/// MIPI CSI-2 RAW10 (specification 11.4.4; V4L2's 10P): four bytes with the upper eight bits, then one with the lower
/// two of each, the first pixel's in its lowest bits. `pixels.size()` is a multiple of 4; `packed` has 5/4 as many
/// bytes.
inline void unpack10(std::span<const std::byte> packed, std::span<std::uint16_t> pixels) {
  const std::byte* in = packed.data();
  for (std::size_t i = 0; i + 4 <= pixels.size(); i += 4, in += 5) {
    const unsigned low = std::to_integer<unsigned>(in[4]);
    pixels[i] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[0]) << 2 | (low & 3));
    pixels[i + 1] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[1]) << 2 | (low >> 2 & 3));
    pixels[i + 2] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[2]) << 2 | (low >> 4 & 3));
    pixels[i + 3] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[3]) << 2 | low >> 6);
  }
}

/// MIPI CSI-2 RAW12 (11.4.5; V4L2's 12P): two bytes with the upper eight bits, then one with the lower four of each,
/// the first pixel's in its lowest bits. `pixels.size()` is a multiple of 2; `packed` has 3/2 as many bytes.
inline void unpack12(std::span<const std::byte> packed, std::span<std::uint16_t> pixels) {
  const std::byte* in = packed.data();
  for (std::size_t i = 0; i + 2 <= pixels.size(); i += 2, in += 3) {
    const unsigned low = std::to_integer<unsigned>(in[2]);
    pixels[i] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[0]) << 4 | (low & 15));
    pixels[i + 1] = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[1]) << 4 | low >> 4);
  }
}

}  // namespace lightwell
