// Little-endian integers, as USB transmits them.
//   put   appends an integer of `bytes` bytes      get   reads one
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lightwell::usb_camera {

using Bytes = std::vector<std::uint8_t>;

inline void put(Bytes& out, std::uint64_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// Bytes beyond the end read as zero.
[[nodiscard]] inline std::uint32_t get(std::span<const std::uint8_t> in, std::size_t at, std::size_t bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes && at + i < in.size(); ++i)
    value |= static_cast<std::uint32_t>(in[at + i]) << (8 * i);
  return value;
}

}  // namespace lightwell::usb_camera
