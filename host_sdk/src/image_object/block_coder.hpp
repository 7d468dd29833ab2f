// Coding of quantised 8 x 8 blocks of transform coefficients, one function for both directions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "image_object/range_coder.hpp"

namespace lightwell::image_object {

inline constexpr int kBlock = 8, kBlockPixels = kBlock * kBlock;

/// Largest magnitude of a quantised coefficient.
inline constexpr int kMaxLevel = (1 << 20) - 1;

/// Position in a block (row * 8 + column) of each place in zigzag order.
[[nodiscard]] constexpr std::array<std::uint8_t, kBlockPixels> zigzag_order() {
  std::array<std::uint8_t, kBlockPixels> order{};
  std::size_t n = 0;
  for (int sum = 0; sum < 2 * kBlock - 1; ++sum)
    for (int i = 0; i <= sum; ++i) {
      const int row = sum % 2 == 0 ? sum - i : i, column = sum - row;
      if (row < kBlock && column < kBlock) order[n++] = static_cast<std::uint8_t>(row * kBlock + column);
    }
  return order;
}
inline constexpr std::array<std::uint8_t, kBlockPixels> kZigzag = zigzag_order();

/// Writes bits; returns them, so that code for both directions reads the same.
struct BitWriter {
  RangeEncoder& coder;
  bool operator()(bool bit, BitModel& model) {
    coder.put(bit, model);
    return bit;
  }
  bool raw(bool bit) {
    coder.put_raw(bit);
    return bit;
  }
};

/// Reads bits; the arguments are ignored.
struct BitReader {
  RangeDecoder& coder;
  bool operator()(bool, BitModel& model) { return coder.get(model); }
  bool raw(bool) { return coder.get_raw(); }
};

/// Levels of one block and plane in zigzag order; those from `count` on are zero.
struct BlockLevels {
  std::array<std::int32_t, kBlockPixels> level{};
  int count = 0;
};

/// Context models of one kind of planes.
class BlockModels {
 public:
  /// What the planes of a block that came before say about the next one. Start a block with a new one.
  struct Context {
    std::array<std::uint8_t, kBlockPixels + 1> activity{};  ///< Of each place: recent magnitudes.
    int recent = 0;                                         ///< Recent counts.
  };

  /// Codes `block`. `neighbours`: sum of the counts of the blocks left and above, same plane.
  template <class Bits>
  void code(Bits& bits, BlockLevels& block, Context& context, int neighbours) {
    const auto recent = static_cast<std::size_t>(context.recent < 4     ? 0
                                                 : context.recent < 12  ? 1
                                                 : context.recent < 32  ? 2
                                                 : context.recent < 64  ? 3
                                                 : context.recent < 128 ? 4
                                                 : context.recent < 256 ? 5
                                                                        : 6);
    const std::size_t beside = neighbours == 0 ? 0 : neighbours < 4 ? 1 : neighbours < 16 ? 2 : 3;
    if (bits(block.count == 0, empty_[recent][beside])) {
      block.count = 0;
    } else {
      block.count = 1 + code_tree(bits, block.count - 1, last_[recent][beside]);
      code_levels(bits, block, context);
    }
    context.recent += (16 * block.count - context.recent) / 2;
    for (std::uint8_t& activity : context.activity) activity = static_cast<std::uint8_t>(activity >> 1);
    for (std::size_t z = 0; z < static_cast<std::size_t>(block.count); ++z)
      context.activity[z] = static_cast<std::uint8_t>(context.activity[z] + 8 * std::min(std::abs(block.level[z]), 7));
  }

 private:
  static constexpr std::size_t kRecent = 7, kBeside = 4, kActivity = 6, kPlaces = 7, kPrevious = 3, kUnary = 14;

  template <class Bits>
  static int code_tree(Bits& bits, int value, std::array<BitModel, kBlockPixels>& models) {
    std::size_t node = 1;
    for (int bit = 5; bit >= 0; --bit) node = 2 * node + (bits((value >> bit & 1) != 0, models[node]) ? 1 : 0);
    return static_cast<int>(node) - kBlockPixels;
  }

  [[nodiscard]] static std::size_t activity_class(const Context& context, std::size_t z) {
    const int sum = 2 * context.activity[z] + context.activity[z + 1] + (z > 0 ? context.activity[z - 1] : 0);
    return sum == 0 ? 0 : sum < 8 ? 1 : sum < 18 ? 2 : sum < 36 ? 3 : sum < 80 ? 4 : 5;
  }

  template <class Bits>
  void code_levels(Bits& bits, BlockLevels& block, const Context& context) {
    int previous = 0;
    for (int z = 0; z < block.count; ++z) {
      const auto place = static_cast<std::size_t>(z);
      const std::size_t active = activity_class(context, place);
      const std::size_t where = z == 0 ? 0 : z < 3 ? 1 : z < 6 ? 2 : z < 10 ? 3 : z < 15 ? 4 : z < 28 ? 5 : 6;
      const std::size_t before = previous == 0 ? 0 : previous < 3 ? 1 : 2;
      std::int32_t& level = block.level[place];
      const bool last = z == block.count - 1;
      if (!last && !bits(level != 0, nonzero_[where][active][before])) {
        level = 0;
        previous = previous / 2;
        continue;
      }
      const bool negative = bits.raw(level < 0);
      const int magnitude = code_magnitude(bits, std::abs(level), more_[active]);
      level = negative ? -magnitude : magnitude;
      previous = previous / 2 + std::min(magnitude, 4);
    }
  }

  /// 1 to kMaxLevel: unary up to kUnary, then Exp-Golomb.
  template <class Bits>
  static int code_magnitude(Bits& bits, int magnitude, std::array<BitModel, kUnary>& models) {
    for (std::size_t k = 0; k < kUnary; ++k)
      if (!bits(magnitude > static_cast<int>(k) + 1, models[k])) return static_cast<int>(k) + 1;
    const int rest = magnitude - static_cast<int>(kUnary);
    int width = 0;
    while (width < 20 && bits.raw(rest >> (width + 1) != 0)) ++width;
    int value = 1;
    for (int bit = width - 1; bit >= 0; --bit) value = 2 * value + (bits.raw((rest >> bit & 1) != 0) ? 1 : 0);
    return std::min(value + static_cast<int>(kUnary), kMaxLevel);
  }

  std::array<std::array<BitModel, kBeside>, kRecent> empty_;
  std::array<std::array<std::array<BitModel, kBlockPixels>, kBeside>, kRecent> last_;
  std::array<std::array<std::array<BitModel, kPrevious>, kActivity>, kPlaces> nonzero_;
  std::array<std::array<BitModel, kUnary>, kActivity> more_;
};

/// Counts of the blocks to the left and above, for each plane.
class NeighbourCounts {
 public:
  NeighbourCounts(std::size_t planes, std::size_t block_columns)
      : columns_(block_columns), counts_(planes * block_columns), left_(planes) {}

  /// Starts the row of blocks.
  void start_row() { std::fill(left_.begin(), left_.end(), std::uint8_t{0}); }
  [[nodiscard]] int sum(std::size_t plane, std::size_t column) const {
    return counts_[plane * columns_ + column] + left_[plane];
  }
  void set(std::size_t plane, std::size_t column, int count) {
    counts_[plane * columns_ + column] = left_[plane] = static_cast<std::uint8_t>(count);
  }

 private:
  std::size_t columns_;
  std::vector<std::uint8_t> counts_, left_;
};

}  // namespace lightwell::image_object
