#include <array>

#include <lightwell/checksum.hpp>

namespace lightwell {

std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t seed) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t v = i;
      for (int k = 0; k < 8; ++k) v = (v & 1U) != 0 ? v >> 1 ^ 0x82F63B78U : v >> 1;
      t[i] = v;
    }
    return t;
  }();
  std::uint32_t crc = ~seed;
  for (const std::byte b : bytes) crc = crc >> 8 ^ table[(crc ^ std::to_integer<std::uint32_t>(b)) & 255U];
  return ~crc;
}

}  // namespace lightwell
