// Sparse matrix that is applied to arrays of colours.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lightwell::estimate {

/// Three channels and padding, so that one vector load reads a colour.
struct alignas(16) Rgbx {
  std::array<float, 4> v{};
};

/// out[row] = sum of weight * in[index].
class SparseRows {
 public:
  struct Entry {
    std::uint32_t index = 0;
    float weight = 0;
  };

  void add_row(std::span<const Entry> row) {
    entries_.insert(entries_.end(), row.begin(), row.end());
    end_.push_back(entries_.size());
  }
  [[nodiscard]] std::size_t rows() const { return end_.size(); }
  [[nodiscard]] std::size_t entries() const { return entries_.size(); }

  /// `out` has rows() elements, which may follow those of `in` in the same array.
  void apply(std::span<const Rgbx> in, std::span<Rgbx> out) const {
    std::size_t at = 0;
    for (std::size_t row = 0; row < end_.size(); ++row) {
      // Four independent sums hide the latency of additions.
      std::array<Rgbx, 4> sum{};
      const std::size_t end = end_[row];
      for (; at + 4 <= end; at += 4)
        for (std::size_t lane = 0; lane < 4; ++lane) add(entries_[at + lane], in, sum[lane]);
      for (; at < end; ++at) add(entries_[at], in, sum[0]);
      for (std::size_t k = 0; k < 4; ++k) out[row].v[k] = (sum[0].v[k] + sum[1].v[k]) + (sum[2].v[k] + sum[3].v[k]);
    }
  }

 private:
  static void add(Entry e, std::span<const Rgbx> in, Rgbx& sum) {
    const Rgbx& c = in[e.index];
    for (std::size_t k = 0; k < 4; ++k) sum.v[k] += e.weight * c.v[k];
  }

  std::vector<Entry> entries_;
  std::vector<std::size_t> end_;
};

}  // namespace lightwell::estimate
