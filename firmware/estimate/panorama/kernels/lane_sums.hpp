// The vector kernels under the pass over the pixels: sums down the rows of a block, for every lane of a row at once.
//   sum_lanes           linear or looked-up 8-bit codes, with or without a weight for each
//   sum_wide_lanes      the same of 16-bit words
// From lanes to blocks: block_sums.hpp, and to their light: block_light.hpp. Rows of YCbCr to planes of codes:
// ycbcr_planes.hpp. One source for every vector unit (Highway); which one runs is chosen once, by what the processor
// has. A test goes through all of them with hwy::SetSupportedTargetsForTest().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace lightwell::estimate {

/// Rows that one call may sum: more would overflow the sums of codes.
inline constexpr int kMaxRows = 16;
/// A row must have at least so many lanes: kernels read whole vectors, and shift the last one back.
inline constexpr std::size_t kMinLanes = 64;

/// Linear values of the 256 codes, of full scale 65535.
using CodeTable16 = std::array<std::uint16_t, 256>;

/// One entry a lane. A lane is one sample's place in a row: 3 x + c of interleaved colour, x of a plane or a mosaic.
struct LaneSums {
  std::uint32_t* sum;  ///< Of linear values (times weight, where there is one, over 256).
  std::uint32_t*
      early;  ///< Sum of (rows - y) times linear value, y counting from 0: rows * sum - early is the first moment.
  std::uint16_t* peak;     ///< Largest code where the weight is not zero.
  std::uint16_t* clipped;  ///< Codes of at least `clipped_from` where the weight is not zero.
};

/// `rows` rows of 8-bit codes.
struct CodeRows {
  const std::uint8_t* first;
  std::size_t stride;        ///< Bytes from one row to the next of those summed.
  int rows;                  ///< 1 to kMaxRows.
  const CodeTable16* table;  ///< Null: the code itself is the linear value (plain) or 257 times it (weighted).
  unsigned clipped_from;     ///< 256 and more: nothing clips.
};

/// Rows of 16-bit little-endian words, `mask`ed to at most 12 bits; the masked word is the linear value (plain) or 16
/// times it (weighted).
struct WordRows {
  const std::uint8_t* first;
  std::size_t stride;
  int rows;
  std::uint16_t mask;
  unsigned clipped_from;
};

/// Of lanes [0, lanes), lanes >= kMinLanes. `out` has as many entries.
void sum_lanes(const CodeRows& rows, std::size_t lanes, const LaneSums& out);
/// Weighted by w/256, `weights` a byte for each lane, rows `weight_stride` apart. With a table of null, codes count
/// 257.
void sum_weighted_lanes(const CodeRows& rows, const std::uint8_t* weights, std::size_t weight_stride, std::size_t lanes,
                        const LaneSums& out);
void sum_wide_lanes(const WordRows& rows, std::size_t lanes, const LaneSums& out);
void sum_weighted_wide_lanes(const WordRows& rows, const std::uint8_t* weights, std::size_t weight_stride,
                             std::size_t lanes, const LaneSums& out);

}  // namespace lightwell::estimate
