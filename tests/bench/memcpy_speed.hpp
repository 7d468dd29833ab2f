// The yardstick of every speed figure: how fast this machine copies, in this run.
#pragma once

#include <cstddef>

namespace lightwell::bench {

struct MemcpySpeed {
  double seconds_per_copy = 0;  ///< Of `bytes` bytes; the best of the rounds.
  double gigabytes_per_s = 0;   ///< Bytes copied (read once, written once) a second, in 1e9.
};

/// memcpy of `bytes` bytes through 32 rotating buffers, buffer i to i + 1 mod 32, so that frames of a
/// megabyte come from memory and not from a cache; the best of five rounds of 32 copies each. All
/// pages are touched before. Takes 32 * bytes of memory. `bytes` of 0 gives zeros.
[[nodiscard]] MemcpySpeed memcpy_speed(std::size_t bytes);

}  // namespace lightwell::bench
