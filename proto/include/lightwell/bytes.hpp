// Numbers in binary formats, and the checksum of recordings, environment maps and link frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace lightwell {

/// Writes the integer at `at` in sizeof(Number) bytes, little-endian.
template <class Number, class Byte>
void put_le(Byte* at, Number value) {
  for (std::size_t i = 0; i < sizeof(Number); ++i)
    at[i] = static_cast<Byte>(static_cast<std::uint64_t>(value) >> (8 * i) & 255U);
}

/// Reads it.
template <class Number, class Byte>
[[nodiscard]] Number get_le(const Byte* at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i)
    value |= static_cast<std::uint64_t>(static_cast<unsigned char>(at[i])) << (8 * i);
  return static_cast<Number>(value);
}

namespace detail {
/// Polynomials are reversed: bit 31 is the coefficient of 1.
template <std::uint32_t kPolynomial>
[[nodiscard]] inline std::uint32_t crc(std::span<const std::byte> bytes, std::uint32_t seed) {
  static constexpr auto kTable = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      t[i] = i;
      for (int k = 0; k < 8; ++k) t[i] = (t[i] & 1U) != 0 ? t[i] >> 1 ^ kPolynomial : t[i] >> 1;
    }
    return t;
  }();
  std::uint32_t crc = ~seed;
  for (const std::byte b : bytes) crc = crc >> 8 ^ kTable[(crc ^ std::to_integer<std::uint32_t>(b)) & 255U];
  return ~crc;
}
}  // namespace detail

/// CRC-32C (Castagnoli), as in RFC 3720 B.4. `seed`: the checksum of the preceding bytes, for incremental use.
[[nodiscard]] inline std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t seed = 0) {
  return detail::crc<0x82F63B78U>(bytes, seed);
}

/// CRC-32 of ISO 3309, as in zlib, gzip and MCAP.
[[nodiscard]] inline std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t seed = 0) {
  return detail::crc<0xEDB88320U>(bytes, seed);
}

}  // namespace lightwell
