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

/// Samples of a block, one plane: 4, 8 or 16 rows, `stride` bytes apart, of `bytes` bytes, a multiple of 8.
struct BlockSamples {
  const std::uint8_t* first;
  std::size_t stride;
  int rows;
  std::size_t bytes;
};

struct BlockScan {
  std::uint32_t all = 0, read = 0;  ///< Sums of the samples of all rows, and of those that are read.
  std::uint32_t largest = 0;        ///< Of all rows.
  std::uint32_t largest_chroma = 0;
};

/// Samples are bytes; `largest_chroma` is 0.
[[nodiscard]] BlockScan scan_bytes(const BlockSamples& block, const SampledRows& rows);
/// Samples are the lower 12 bits of 16-bit little-endian words; `largest_chroma` is 0.
[[nodiscard]] BlockScan scan_words(const BlockSamples& block, const SampledRows& rows);
/// Samples are bytes of luma, each followed by a byte of chroma.
[[nodiscard]] BlockScan scan_yuyv(const BlockSamples& block, const SampledRows& rows);

}  // namespace lightwell::estimate
