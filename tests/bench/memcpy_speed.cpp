#include "bench/memcpy_speed.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "bench/equirect_image.hpp"

namespace lightwell::bench {

namespace {

constexpr std::size_t kBuffers = 32;
constexpr int kRounds = 5;

/// Keeps the compiler from removing the copy.
void keep(const void* memory) { asm volatile("" : : "r"(memory) : "memory"); }

}  // namespace

MemcpySpeed memcpy_speed(std::size_t bytes) {
  if (bytes == 0) return {};
  std::vector<std::unique_ptr<unsigned char[]>> buffers;
  for (std::size_t i = 0; i < kBuffers; ++i) {
    buffers.push_back(std::make_unique<unsigned char[]>(bytes));
    std::memset(buffers.back().get(), static_cast<int>(i + 1), bytes);
  }
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) {
    const double start = seconds_now();
    for (std::size_t i = 0; i < kBuffers; ++i) {
      unsigned char* to = buffers[(i + 1) % kBuffers].get();
      std::memcpy(to, buffers[i].get(), bytes);
      keep(to);
    }
    best = std::min(best, (seconds_now() - start) / kBuffers);
  }
  return {best, static_cast<double>(bytes) / best / 1e9};
}

}  // namespace lightwell::bench
