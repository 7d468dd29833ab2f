// SIMD kernel of RowSampling: sums and largest of the raw samples of a block, over all rows and over the rows that a
// pass reads. One source for all instruction sets (Highway).
#pragma once

#include <cstddef>
#include <cstdint>

namespace lightwell::estimate {

/// The rows of a block that a pass reads: `units` groups of `unit` rows, the first after `offset` rows, `step` rows
/// apart. By default all rows.
struct SampledRows {
  int unit = 1, units = 0, offset = 0, step = 1;

  [[nodiscard]] constexpr bool all() const { return units == 0; }
  /// The rows that are read of a block of `rows` rows.
  [[nodiscard]] constexpr int count(int rows) const { return all() ? rows : unit * units; }
  /// Row `index` of these, counted in the block.
  [[nodiscard]] constexpr int row(int index) const { return index / unit * step + offset + index % unit; }
};

/// Of the rows that are read of a block of `rows` rows.
struct RowStatistics {
  double mean = 0, variance = 0;
  double spacing = 0;  ///< Slope of the line through the rows over their index; of two rows or more.
};
[[nodiscard]] constexpr RowStatistics statistics_of(const SampledRows& rows, int of_block) {
  RowStatistics out;
  const int n = rows.count(of_block);
  for (int k = 0; k < n; ++k) out.mean += static_cast<double>(rows.row(k)) / n;
  double products = 0;
  for (int k = 0; k < n; ++k) {
    const double y = rows.row(k) - out.mean;
    out.variance += y * y / n;
    products += y * (k - (n - 1) / 2.0) / n;
  }
  out.spacing = products > 0 ? out.variance / products : 0;
  return out;
}

/// Samples of a block, one plane: 4, 8 or 16 rows, `stride` bytes apart, of `bytes` bytes, a multiple of 8.
struct BlockSamples {
  const std::uint8_t* first;
  std::size_t stride;
  int rows;
  std::size_t bytes;
};

struct BlockScan {
  std::uint32_t all = 0, read = 0;   ///< Sums of the samples of all rows, and of those that are read.
  std::uint32_t largest = 0;         ///< Of all rows.
  std::uint32_t largest_chroma = 0;  ///< Of all rows, where chroma lies between luma.
};

/// Samples are bytes.
[[nodiscard]] BlockScan scan_bytes(const BlockSamples& block, const SampledRows& rows);
/// Samples are 16-bit little-endian words, masked to at most 12 bits.
[[nodiscard]] BlockScan scan_words(const BlockSamples& block, const SampledRows& rows, std::uint16_t mask);
/// Samples are bytes of luma, each followed by a byte of chroma.
[[nodiscard]] BlockScan scan_yuyv(const BlockSamples& block, const SampledRows& rows);
/// `largest` alone of scan_bytes().
[[nodiscard]] std::uint32_t largest_byte(const BlockSamples& block);

}  // namespace lightwell::estimate
