// Speed of memcpy on this machine in this run: the reference for all timings.
#pragma once

#include <cstddef>

namespace lightwell::bench {

struct MemcpySpeed {
  double seconds_per_copy = 0;  ///< Time to copy `bytes` bytes, best of the rounds.
  double gigabytes_per_s = 0;   ///< Copied bytes per second (each is read and written once), in 1e9.
};

/// Measures memcpy of `bytes` bytes between 32 rotating buffers, buffer i to i + 1 mod 32, so that frames of a megabyte
/// come from memory instead of a cache: the best of five rounds of 32 copies each. All pages are touched before. Uses
/// 32 * bytes of memory. Returns zeros for 0 bytes.
[[nodiscard]] MemcpySpeed memcpy_speed(std::size_t bytes);

}  // namespace lightwell::bench
