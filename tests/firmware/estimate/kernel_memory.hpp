// Memory for tests of SIMD kernels that detects reads and writes out of bounds.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <unistd.h>
#include <vector>

#include <sys/mman.h>

#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {

using Random = std::mt19937;

inline unsigned below(Random& random, std::size_t n) { return static_cast<unsigned>(random() % n); }

/// Memory between two inaccessible pages: an access out of bounds ends the test.
class Fenced {
 public:
  explicit Fenced(std::size_t size) : page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) {
    size_ = (size + page_ - 1) / page_ * page_;
    all_ = static_cast<std::uint8_t*>(mmap(nullptr, size_ + 2 * page_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    if (all_ == MAP_FAILED || mprotect(all_ + page_, size_, PROT_READ | PROT_WRITE) != 0) std::abort();
  }
  Fenced(const Fenced&) = delete;
  Fenced& operator=(const Fenced&) = delete;
  ~Fenced() { munmap(all_, size_ + 2 * page_); }

  /// `bytes` bytes that begin directly after the first page, or end directly before the second.
  std::uint8_t* place(std::size_t bytes, bool at_the_end) {
    if (bytes > size_) std::abort();
    return all_ + page_ + (at_the_end ? size_ - bytes : 0);
  }

 private:
  std::size_t page_, size_;
  std::uint8_t* all_;
};

/// An array of `count` elements with guard elements on either side that must not change.
template <class T>
class Guarded {
 public:
  explicit Guarded(std::size_t count) : values_(count + 2 * kGuard, mark()) {}
  T* data() { return values_.data() + kGuard; }
  T operator[](std::size_t i) const { return values_[i + kGuard]; }
  [[nodiscard]] bool guards_hold() const {
    const auto is_mark = [](T v) { return v == mark(); };
    return std::all_of(values_.begin(), values_.begin() + kGuard, is_mark) &&
           std::all_of(values_.end() - kGuard, values_.end(), is_mark);
  }

 private:
  /// Wider than any vector.
  static constexpr std::ptrdiff_t kGuard = 256;
  static T mark() { return static_cast<T>(0xA5A5A5A5U); }
  std::vector<T> values_;
};

struct Sums {
  Guarded<std::uint32_t> sum, early;
  Guarded<std::uint16_t> peak, clipped;
  explicit Sums(std::size_t n) : sum(n), early(n), peak(n), clipped(n) {}
  LaneSums out() { return {sum.data(), early.data(), peak.data(), clipped.data()}; }
  [[nodiscard]] bool guards_hold() const {
    return sum.guards_hold() && early.guards_hold() && peak.guards_hold() && clipped.guards_hold();
  }
};

/// Fills all bytes, padding between rows included: `how` 0: 255, 1: 0, otherwise random.
inline void fill(std::uint8_t* at, std::size_t bytes, unsigned how, Random& random) {
  for (std::size_t i = 0; i < bytes; ++i)
    at[i] = how == 0 ? 255 : how == 1 ? 0 : static_cast<std::uint8_t>(random() >> 8);
}

}  // namespace lightwell::estimate
