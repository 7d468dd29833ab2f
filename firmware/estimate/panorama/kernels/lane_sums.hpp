// SIMD kernels of CodePass: sums over the rows of a block, for all lanes of a row at once, of 8-bit codes (sum_lanes)
// and of 16-bit words (sum_wide_lanes). block_light.hpp sums lanes to blocks and converts these to light,
// ycbcr_planes.hpp converts YCbCr to planes of codes. One source for all instruction sets (Highway), dispatched at run
// time; tests run all of them with hwy::SetSupportedTargetsForTest().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace lightwell::estimate {

/// Largest number of rows per call: more would overflow 16-bit sums of codes.
inline constexpr int kMaxRows = 16;
/// Smallest number of lanes of a row: kernels read whole vectors, and shift the last one back.
inline constexpr std::size_t kMinLanes = 64;

/// Linear values of the 256 codes; full scale is 65535.
using CodeTable16 = std::array<std::uint16_t, 256>;

/// One element per lane. A lane is the position of a sample in a row: 3 x + c for interleaved colour, x for a plane or
/// a mosaic.
struct LaneSums {
  std::uint32_t* sum;      ///< Sum of linear values (weighted: times weight / 256).
  std::uint32_t* early;    ///< Sum of linear value times (rows - y), y from 0; rows * sum - early is the first moment.
  std::uint16_t* peak;     ///< Largest code with a nonzero weight.
  std::uint16_t* clipped;  ///< Number of codes of at least `clipped_from` with a nonzero weight.
};

/// `rows` rows of 8-bit codes.
struct CodeRows {
  const std::uint8_t* first;
  std::size_t stride;        ///< Bytes between rows that are summed.
  int rows;                  ///< 1 to kMaxRows.
  const CodeTable16* table;  ///< Null: the code itself is the linear value (plain) or 257 times it (weighted).
  unsigned clipped_from;     ///< 256 or more: no code is clipped.
};

/// Rows of 16-bit little-endian words, masked by `mask` to at most 12 bits. The masked word is the linear value
/// (plain), or 16 times it (weighted).
struct WordRows {
  const std::uint8_t* first;
  std::size_t stride;
  int rows;
  std::uint16_t mask;
  unsigned clipped_from;
};

/// Weights w / 256 of the samples: a byte per lane, rows `stride` bytes apart. Null `first`: plain sums.
struct LaneWeights {
  const std::uint8_t* first = nullptr;
  std::size_t stride = 0;
};

/// Sums lanes [0, lanes), lanes >= kMinLanes. `out` has as many elements.
void sum_lanes(const CodeRows& rows, const LaneWeights& weights, std::size_t lanes, const LaneSums& out);
void sum_wide_lanes(const WordRows& rows, const LaneWeights& weights, std::size_t lanes, const LaneSums& out);

}  // namespace lightwell::estimate
